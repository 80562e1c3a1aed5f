"""The study of hands and objects that a policy never saw: which pairs are tried where only some are."""

from collections import Counter
from pathlib import Path

import pytest

from family_config import FamilyConfig
from family_study import check_study, sampled
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.errors import InputError


@pytest.mark.parametrize("every", [2, 3, 4, 7, 30])
def test_a_sample_has_all_hands_and_objects_about_as_often(every: int) -> None:
    usual = FamilyConfig()
    asked = SweepConfig(hands=usual.hands, objects=usual.objects, directions=usual.directions, out=Path("study"))
    parts = list(sampled(asked, every))
    assert len({part.out for part in parts}) == len(parts)
    pairs = [(part.hands[0], thing) for part in parts for thing in part.objects]
    assert len(set(pairs)) == len(pairs)
    assert all(len(part.hands) == 1 and part.directions == asked.directions for part in parts)
    for names, column in ((usual.hands, 0), (usual.objects, 1)):
        share = len(usual.hands) * len(usual.objects) / len(names) / every
        often = Counter(pair[column] for pair in pairs)
        assert all(int(share) <= often[name] <= share + 1 for name in names)


@pytest.mark.parametrize(("sample", "new"), [(0, ()), (2, FamilyConfig().new)])
def test_samples_that_are_none_are_refused(sample: int, new: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=f"--sample {sample} with --new"):
        check_study(FamilyConfig(sample=sample, new=new))

"""The study of hands and objects that a policy never saw: which directions are tried where only some are."""

from collections import Counter
from itertools import product
from pathlib import Path

import pytest

from family_config import FamilyConfig
from family_study import check_study, sampled
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.sweep import directions_of
from inhand.errors import InputError


@pytest.mark.parametrize("count", [1, 2, 5, 18, 30])
def test_a_sample_has_every_pair_once_and_all_directions_alike(count: int) -> None:
    usual = FamilyConfig()
    asked = SweepConfig(hands=usual.hands, objects=usual.objects, directions=usual.directions, out=Path("study"))
    parts = list(sampled(asked, count))
    assert len({part.out for part in parts}) == len(parts)
    pairs = Counter(pair for part in parts for pair in product(part.hands, part.objects))
    assert pairs == dict.fromkeys(product(usual.hands, usual.objects), 1)
    tried = Counter(dict.fromkeys(directions_of(asked), 0))
    for part in parts:
        for name in directions_of(part):
            tried[name] += len(part.hands) * len(part.objects)
    assert len(tried) == 18
    assert max(tried.values()) - min(tried.values()) <= 1
    assert all(abs(len(directions_of(part)) - count) <= 1 for part in parts if count <= 18)


@pytest.mark.parametrize(("sample", "new"), [(-1, ()), (2, FamilyConfig().new)])
def test_samples_that_are_none_are_refused(sample: int, new: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=f"--sample {sample} with --new"):
        check_study(FamilyConfig(sample=sample, new=new))

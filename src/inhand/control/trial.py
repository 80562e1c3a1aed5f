"""What an episode leaves: a `Trial`, and its file."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.archives import check_shapes, read_arrays
from inhand.control.episode import SHAPES, Episode, Source
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array, planar, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.records import read_json, read_record, text_of

FORMAT, SPATIAL_FORMAT = 2, 1
"""Versions of the file's layout, of hands in the plane and in space."""
CURE = "give a .npz file from the `trials` folder of a run, or run it again"

REACHED = "reached"
LOST_CONTACT = "lost contact"
NO_GRASP = "no grasp"
TIME_OUT = "time out"
DIVERGED = "diverged"
STOPPED = "stopped"
GRIP_END = "end of grip"
NO_MOVEMENT = "no movement"
OUTCOMES = (REACHED, GRIP_END, NO_MOVEMENT, LOST_CONTACT, NO_GRASP, TIME_OUT, DIVERGED, STOPPED)
"""How a trial can end: at the end of its path, where the grip was predicted to end, or where it began, the object held
in all three. A sequence of primitives stops where one has failed too often, the object still held."""
KEPT = (REACHED, GRIP_END)
"""Those that carried the object, and had it in the hand at the end; how far is another question."""
LOST = (LOST_CONTACT, NO_GRASP, DIVERGED)
"""Those without the object in the hand."""

_WHOLE = ("phase", "contact_links")
"""Arrays of whole numbers."""
T = TypeVar("T", "Trial", "AnyTrial")


@dataclass(frozen=True, kw_only=True)
class Passport(Source):
    """Where a trial of a hand in the plane comes from."""

    hand: HandSpec
    object: ObjectSpec
    angle_deg: float | None
    """Direction of the primitive [deg], None where it only rotates."""
    rotation_deg: float
    """Rotation to hold, or to reach where there is no direction [deg]."""
    path: str
    """Name of the reference path."""

    @property
    def turns(self) -> bool:
        """Whether the primitive only turns the object."""
        return self.angle_deg is None


@dataclass(frozen=True, eq=False)
class Trial(Episode[Passport]):
    """One recorded episode of a hand in the plane."""

    @property
    def torque_max_nmm(self) -> float:
        """Largest torque of a finger's contact about the object's middle, round the upright axis, in any row [N mm]."""
        arm = self.object_points - self.object_pose[:, None, :3]
        return 1e3 * float(np.abs(np.cross(arm, self.forces)[..., 2]).max())

    def manipulated_path(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return positions `(M, 2)` [mm] from the start of manipulation, rotation `(M,)` [deg], and contact.

        The rotation counts from the grasp, so that a twist before manipulation is part of it. A trial whose grasp
        failed gives one row at the origin without contact.
        """
        rows = self.manipulation
        pose = planar(self.object_pose[rows])
        if len(pose) == 0:
            return np.zeros((1, 2)), np.zeros(1), np.zeros((1, self.gaps.shape[1]), dtype=bool)
        before = planar(self.object_pose[self.grasped])[2]
        rotation = np.rad2deg(np.unwrap(pose[:, 2]) - pose[0, 2] + wrap_angle(pose[0, 2] - before))
        return 1e3 * (pose[:, :2] - pose[0, :2]), rotation, self.touching[rows]


AnyTrial: TypeAlias = Trial | SpatialTrial
"""What an episode leaves, in the plane or in space."""


@dataclass(frozen=True)
class _Head:
    format: int
    outcome: str
    phases: tuple[str, ...]
    passport: Any

    def __post_init__(self) -> None:
        """Refuse an outcome that no trial has."""
        if self.outcome not in OUTCOMES:
            raise InputError(f"outcome is {self.outcome!r}; it must be {' or '.join(OUTCOMES)}")


@dataclass(frozen=True)
class _PlanarHead(_Head):
    passport: Passport


@dataclass(frozen=True)
class _SpatialHead(_Head):
    passport: SpatialPassport
    space: bool = True


def save_trial(trial: AnyTrial, path: Path) -> None:
    """Write a trial to a `.npz` file without pickles, under a temporary name that is then moved into place."""
    kind: Callable[..., _Head] = _PlanarHead if isinstance(trial, Trial) else _SpatialHead
    form = FORMAT if isinstance(trial, Trial) else SPATIAL_FORMAT
    head = text_of(kind(form, trial.outcome, trial.phases, trial.passport))
    arrays = {name: getattr(trial, name) for name in SHAPES}
    with in_place(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, head=np.array(head), **arrays)


def load_trial(path: str | Path) -> Trial:
    """Return the trial of a `.npz` file, of a hand in the plane.

    Raises:
        InputError: as `load_any`, or a hand in space.
    """
    trial = load_any(path)
    if isinstance(trial, SpatialTrial):
        raise InputError(
            f"{path} has a hand in space, and only trials of hands in the plane have a place here: give one of"
            " those, or read it in Python by inhand.load"
        )
    return trial


def load_any(path: str | Path) -> AnyTrial:
    """Return the trial of a `.npz` file, of a hand in the plane or in space.

    Raises:
        InputError: no file, not a trial, or a trial of another format; the text names the field or the array.
    """
    if not Path(path).is_file():
        raise InputError(f"no trial file {path}: give a .npz file from the `trials` folder of a run")
    try:
        return _read_trial(Path(path))
    except InputError as error:
        raise InputError(f"{path} is not a trial: {error}; {CURE}") from error


def _read_trial(path: Path) -> AnyTrial:
    told = read_json(str(read_arrays(path, {"head": "text"})["head"]))
    head: _Head
    if isinstance(told, dict) and told.get("space") is True:
        head, row = read_record(told, _SpatialHead, SPATIAL_FORMAT), 6
    else:
        head, row = read_record(told, _PlanarHead, FORMAT), 3
    arrays = _measured(path, head.passport.hand.slices, head.phases, SHAPES | {"reference": ("S", row)})
    made: Callable[..., AnyTrial] = Trial if isinstance(head, _PlanarHead) else SpatialTrial
    return made(passport=head.passport, outcome=head.outcome, phases=head.phases, **arrays)


def _measured(
    path: Path, fingers: Sequence[slice], phases: Sequence[str], shapes: dict[str, tuple[str | int, ...]]
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a trial's file, of the shapes that the joints of its fingers and its phases ask for.

    Raises:
        InputError: others; the text names the array.
    """
    arrays = read_arrays(path, {name: "whole numbers" if name in _WHOLE else "numbers" for name in shapes})
    if len(arrays["reference"]) == 1:
        raise InputError("reference has one way-point; a path has two or more")
    check_shapes(arrays, shapes, {"n": fingers[-1].stop, "F": len(fingers)})
    below = [("phase", arrays["phase"], len(phases))]
    for place, links in zip(fingers, arrays["contact_links"].T, strict=True):
        below.append(("contact_links", links, place.stop - place.start))
    for name, values, count in below:
        if values.min() < 0 or values.max() >= count:
            raise InputError(f"{name} holds {np.unique(values).tolist()}; it must hold numbers from 0 to {count - 1}")
    return arrays


def file_name(name: str) -> str:
    """Return a primitive's name as part of a file name: `In'-Right'` is `in1-right1`, apart from `in-right`."""
    return name.lower().replace("'", "1").replace(" ", "_")


def write_trials(trials: Iterable[AnyTrial], folder: Path) -> None:
    """Write trials to the folder `trials` of a run's folder."""
    place = folder / "trials"
    place.mkdir(parents=True)
    for trial in trials:
        primitive, number = trial.label
        save_trial(trial, place / f"{file_name(primitive)}_{number}.npz")


def load_all(folder: Path) -> list[AnyTrial]:
    """Return the trials that `write_trials` left in a run's folder, in the order of their names and numbers.

    Raises:
        InputError: there are none, or one that cannot be read.
    """
    return _sorted_trials(folder, load_any)


def load_trials(folder: Path) -> list[Trial]:
    """Return the same of a hand in the plane.

    Raises:
        InputError: as `load_all`, or trials in space.
    """
    return _sorted_trials(folder, load_trial)


def _sorted_trials(folder: Path, load: Callable[[Path], T]) -> list[T]:
    trials = [load(path) for path in (folder / "trials").glob("*.npz")]
    if not trials:
        raise InputError(f"{folder} holds no trials: give the whole folder of a run")
    return sorted(trials, key=lambda trial: trial.label)


def write_json(content: object, path: Path) -> None:
    """Write JSON under a temporary name and move it into place; numbers that are not finite become null."""
    with in_place(path) as temporary:
        temporary.write_text(text_of(content, indent=2), encoding="utf-8")

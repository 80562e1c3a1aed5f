"""What an episode leaves: a `Trial`, and its file."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.archives import check_shapes, read_arrays
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array, planar, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.records import read_json, read_record, text_of
from inhand.sim.disturbance_files import NONE
from inhand.sim.drawn import Disturbed
from inhand.sim.names import UNTOLD
from inhand.sim.state import CONTACT_TOLERANCE

FORMAT = 2
"""Version of the file's layout."""
MANIPULATE = "manipulate"
"""Name of the phase that metrics measure (thesis 3.4)."""
TWIST = "twist"
"""Name of the phase before it in which the object is turned on the spot."""

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

DEEP_MM = 0.5
"""Overlap above which a contact is softer than a hand's is [mm]: guessed, where reports of simulated hands draw it."""


@dataclass(frozen=True)
class Passport:
    """Where a trial comes from: enough to run it again."""

    hand: HandSpec
    object: ObjectSpec
    controller: str
    """Name of the controller that manipulates."""
    primitive: str
    angle_deg: float | None
    """Direction of the primitive [deg], None where it only rotates."""
    rotation_deg: float
    """Rotation to hold, or to reach where there is no direction [deg]."""
    path: str
    """Name of the reference path."""
    trial: int
    """Number of the trial in its direction, from 1."""
    seed: int
    substeps: int
    """Physics steps between two rows."""
    timestep: float
    """Physics step [s]."""
    versions: dict[str, str]
    """Versions of this package and of what it ran on."""
    engine: str = UNTOLD
    limit: float | None = None
    """How far the hand could carry the object along the primitive [m], or turn it [rad]; None where unknown."""
    reads: str = "privileged"
    """What the controller reads: privileged, or sensed where it knows no more than a hand can."""
    disturbed: Disturbed | None = None
    """How its world was disturbed, with all that was drawn; None where nothing was. Hand and object are those that the
    controller was told."""

    @property
    def period(self) -> float:
        """Time between two rows [s]."""
        return self.substeps * self.timestep

    @property
    def disturb(self) -> str:
        """Name of what disturbed its world; none where nothing did."""
        return NONE if self.disturbed is None else self.disturbed.spec.name

    def __post_init__(self) -> None:
        """Refuse what no trial has."""
        for name in ("trial", "substeps", "timestep"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} is {getattr(self, name)}; it must be above 0")


@dataclass(frozen=True, eq=False)
class Episode(ABC):
    """What is measured in one recorded episode of T rows, in the palm frame and SI units."""

    outcome: str
    """How it ended, one of `OUTCOMES`."""
    phases: tuple[str, ...]
    """Names of the phases in their order."""
    phase: NDArray[np.int64]
    """The phase of each row `(T,)`, an index into `phases`."""
    time: Array
    """Simulated time `(T,)` [s]."""
    object_pose: Array
    """Object poses `(T, 7)`: position [m], quaternion w x y z."""
    joint_angles: Array
    """Joint angles `(T, n)` [rad]."""
    targets: Array
    """Commanded joint angles `(T, n)` [rad]."""
    gaps: Array
    """Distance of each finger to the object `(T, F)` [m]."""
    contact_links: NDArray[np.int64]
    """Link of each finger nearest to the object `(T, F)`."""
    finger_points: Array
    """Nearest points of the fingers `(T, F, 3)` [m]."""
    object_points: Array
    """Nearest points of the object `(T, F, 3)` [m]."""
    forces: Array
    """Force of each finger on the object during the physics step before each row `(T, F, 3)` [N]."""
    penetration: Array
    """Deepest overlap of a link and the object `(T,)` [m]."""
    reference: Array
    """The reference path `(S, 3)` relative to the start of manipulation, in palm axes [m, m, rad]; in space `(S, 6)`,
    positions [m] and rotation vectors [rad]."""

    @property
    @abstractmethod
    def head(self) -> object:
        """What its file says besides the arrays."""

    @property
    @abstractmethod
    def label(self) -> tuple[str, int]:
        """Its primitive, and its number in that direction."""

    @property
    def manipulation(self) -> slice:
        """Rows of the manipulation phase; empty where the grasp failed."""
        if MANIPULATE not in self.phases:
            raise InputError(
                f"no phase is called {MANIPULATE!r}, only {', '.join(self.phases)}; metrics measure that one"
            )
        rows = np.flatnonzero(self.phase == self.phases.index(MANIPULATE))
        return slice(int(rows[0]), int(rows[-1]) + 1) if len(rows) else slice(len(self.time), len(self.time))

    @property
    def grasped(self) -> int:
        """Row at which the object is held and nothing has moved yet: the start of the twist or of manipulation."""
        held = [self.phases.index(name) for name in (TWIST, MANIPULATE) if name in self.phases]
        return int(np.argmax(np.isin(self.phase, held)))

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether each finger touches the object `(T, F)`."""
        return self.gaps <= CONTACT_TOLERANCE

    @property
    def force_max_n(self) -> float:
        """Largest force of a finger on the object in any row [N]."""
        return float(np.linalg.norm(self.forces, axis=-1).max())

    @property
    def penetration_max_mm(self) -> float:
        """Deepest overlap of a link and the object in any row [mm]."""
        return 1e3 * float(self.penetration.max())

    @property
    def penetration_mean_mm(self) -> float:
        """Mean over time of the deepest overlap while the object is manipulated [mm]; 0 where it never was."""
        held = self.penetration[self.manipulation]
        return 1e3 * float(held.mean()) if len(held) else 0.0

    @property
    def penetration_share(self) -> float:
        """Share of that time in which it is more than `DEEP_MM`."""
        held = self.penetration[self.manipulation]
        return float((1e3 * held > DEEP_MM).mean()) if len(held) else 0.0


@dataclass(frozen=True, eq=False)
class Trial(Episode):
    """One recorded episode of a hand in the plane."""

    passport: Passport

    @property
    def head(self) -> object:
        """What its file says besides the arrays."""
        return _Head(FORMAT, self.outcome, self.phases, self.passport)

    @property
    def label(self) -> tuple[str, int]:
        """Its primitive, and its number in that direction."""
        return self.passport.primitive, self.passport.trial

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


SHAPES: dict[str, tuple[str | int, ...]] = {
    "phase": ("T",),
    "time": ("T",),
    "object_pose": ("T", 7),
    "joint_angles": ("T", "n"),
    "targets": ("T", "n"),
    "gaps": ("T", "F"),
    "contact_links": ("T", "F"),
    "finger_points": ("T", "F", 3),
    "object_points": ("T", "F", 3),
    "forces": ("T", "F", 3),
    "penetration": ("T",),
    "reference": ("S", 3),
}
"""Shapes of a trial's arrays: T rows, n joints, F fingers, S way-points."""
_WHOLE = ("phase", "contact_links")
"""Those of whole numbers."""


@dataclass(frozen=True)
class _Head:
    format: int
    outcome: str
    phases: tuple[str, ...]
    passport: Passport

    def __post_init__(self) -> None:
        """Refuse an outcome that no trial has."""
        if self.outcome not in OUTCOMES:
            raise InputError(f"outcome is {self.outcome!r}; it must be {' or '.join(OUTCOMES)}")


def save_trial(trial: Episode, path: Path) -> None:
    """Write a trial to a `.npz` file without pickles, under a temporary name that is then moved into place."""
    head = text_of(trial.head)
    arrays = {name: getattr(trial, name) for name in SHAPES}
    with in_place(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, head=np.array(head), **arrays)


def load_trial(path: str | Path) -> Trial:
    """Return the trial of a `.npz` file.

    Raises:
        InputError: no file, not a trial, or a trial of another format; the text names the field or the array.
    """
    if not Path(path).is_file():
        raise InputError(f"no trial file {path}: give a .npz file from the `trials` folder of a run")
    try:
        return _read_trial(Path(path))
    except InputError as error:
        raise InputError(
            f"{path} is not a trial: {error}; give a .npz file from the `trials` folder of a run, or run it again"
        ) from error


def _read_trial(path: Path) -> Trial:
    told = read_head(path)
    if isinstance(told, dict) and told.get("space") is True:
        raise InputError("its hand is one in space, and only hands in the plane have a place here")
    head = read_record(told, _Head, FORMAT)
    arrays = measured(path, head.passport.hand.slices, head.phases, SHAPES)
    return Trial(passport=head.passport, outcome=head.outcome, phases=head.phases, **arrays)


def read_head(path: Path) -> object:
    """Return what the file of a trial says besides its arrays."""
    return read_json(str(read_arrays(path, {"head": "text"})["head"]))


def measured(
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


def write_trials(trials: Iterable[Episode], folder: Path) -> None:
    """Write trials to the folder `trials` of a run's folder."""
    place = folder / "trials"
    place.mkdir(parents=True)
    for trial in trials:
        primitive, number = trial.label
        save_trial(trial, place / f"{file_name(primitive)}_{number}.npz")


def load_trials(folder: Path) -> list[Trial]:
    """Return the trials that `write_trials` left in a run's folder, in the order of their names and numbers.

    Raises:
        InputError: there are none, or one that cannot be read.
    """
    trials = [load_trial(path) for path in (folder / "trials").glob("*.npz")]
    if not trials:
        raise InputError(f"{folder} holds no trials: give the whole folder of a run")
    return sorted(trials, key=lambda trial: (trial.passport.primitive, trial.passport.trial))


def write_json(content: object, path: Path) -> None:
    """Write JSON under a temporary name and move it into place; numbers that are not finite become null."""
    with in_place(path) as temporary:
        temporary.write_text(text_of(content, indent=2), encoding="utf-8")

"""Trials of hands in space, and the files of trials of either kind."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.control.trial import OUTCOMES, SHAPES, Episode, Trial, load_trial, measured, read_head
from inhand.errors import InputError
from inhand.geometry import Array, inverse_quaternion
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.records import read_record
from inhand.rotations import multiply

FORMAT = 1
"""Version of the file's layout."""
SPATIAL_SHAPES = SHAPES | {"reference": ("S", 6)}
"""Shapes of a trial's arrays."""


@dataclass(frozen=True)
class SpatialPassport:
    """Where a trial comes from: enough to run it again."""

    hand: SpatialHand
    object: SolidSpec
    controller: str
    """Name of the controller that manipulates."""
    primitive: str
    along: Vector | None
    """Unit vector of the primitive's direction, None where it only turns."""
    about: Vector | None
    """Unit vector about which it turns, None where it does not."""
    gravity: Vector
    """Gravity in the palm frame [m/s^2]."""
    trial: int
    """Number of the trial in its direction, from 1."""
    seed: int
    substeps: int
    """Physics steps between two rows."""
    timestep: float
    """Physics step [s]."""
    versions: dict[str, str]
    """Versions of this package and of what it ran on."""
    engine: str = "mujoco"
    limit: float | None = None
    """How far the hand could carry the object along the primitive [m], or turn it [rad]; None where unknown."""
    reads: str = "privileged"
    """What the controller reads."""

    @property
    def period(self) -> float:
        """Time between two rows [s]."""
        return self.substeps * self.timestep

    @property
    def turns(self) -> bool:
        """Whether the primitive only turns the object."""
        return self.along is None

    def __post_init__(self) -> None:
        """Refuse what no trial has."""
        for name in ("trial", "substeps", "timestep"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} is {getattr(self, name)}; it must be above 0")


@dataclass(frozen=True, eq=False)
class SpatialTrial(Episode):
    """One recorded episode of a hand in space."""

    passport: SpatialPassport

    @property
    def head(self) -> object:
        """What its file says besides the arrays."""
        return _Head(FORMAT, True, self.outcome, self.phases, self.passport)

    @property
    def label(self) -> tuple[str, int]:
        """Its primitive, and its number in that direction."""
        return self.passport.primitive, self.passport.trial

    @property
    def torque_max_nmm(self) -> float:
        """Largest torque of a finger's contact about the object's middle in any row [N mm]."""
        arm = self.object_points - self.object_pose[:, None, :3]
        return 1e3 * float(np.linalg.norm(np.cross(arm, self.forces), axis=-1).max())

    def manipulated(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return positions `(M, 3)` [mm] and rotations `(M, 4)` (quaternions) from the grasp on, and contact.

        A trial whose grasp failed gives one row at the origin without contact.
        """
        rows = self.manipulation
        pose = self.object_pose[rows]
        if len(pose) == 0:
            return np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, self.gaps.shape[1]), dtype=bool)
        turned = multiply(pose[:, 3:], inverse_quaternion(pose[:1, 3:]))
        return 1e3 * (pose[:, :3] - pose[0, :3]), turned, self.touching[rows]


AnyTrial: TypeAlias = Trial | SpatialTrial
"""What an episode leaves, in the plane or in space."""


@dataclass(frozen=True)
class _Head:
    format: int
    space: bool
    outcome: str
    phases: tuple[str, ...]
    passport: SpatialPassport

    def __post_init__(self) -> None:
        """Refuse an outcome that no trial has."""
        if self.outcome not in OUTCOMES:
            raise InputError(f"outcome is {self.outcome!r}; it must be {' or '.join(OUTCOMES)}")


def load_any(path: str | Path) -> AnyTrial:
    """Return the trial of a `.npz` file, of a hand in the plane or in space.

    Raises:
        InputError: no file, not a trial, or a trial of another format; the text names the field or the array.
    """
    place = Path(path)
    try:
        head = read_head(place) if place.is_file() else None
    except InputError:
        head = None
    if not (isinstance(head, dict) and head.get("space") is True):
        return load_trial(path)  # which tells what is wrong with it
    try:
        found = read_record(head, _Head, FORMAT)
        arrays = measured(place, found.passport.hand.slices, found.phases, SPATIAL_SHAPES)
    except InputError as error:
        raise InputError(
            f"{path} is not a trial: {error}; give a .npz file from the `trials` folder of a run, or run it again"
        ) from error
    return SpatialTrial(passport=found.passport, outcome=found.outcome, phases=found.phases, **arrays)


def load_all(folder: Path) -> list[AnyTrial]:
    """Return the trials that `write_trials` left in a run's folder, in the order of their names and numbers.

    Raises:
        InputError: there are none, or one that cannot be read.
    """
    trials = [load_any(path) for path in (folder / "trials").glob("*.npz")]
    if not trials:
        raise InputError(f"{folder} holds no trials: give the whole folder of a run")
    return sorted(trials, key=lambda trial: trial.label)

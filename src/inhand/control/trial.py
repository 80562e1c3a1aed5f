"""What an episode leaves: a `Trial`, and its file."""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, planar, wrap_angle
from inhand.hands.hand import Corners, FingerSpec, HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.state import CONTACT_TOLERANCE

FORMAT = 1
"""Version of the file's layout."""
MANIPULATE = "manipulate"
"""Name of the phase that metrics measure (thesis 3.4)."""
TWIST = "twist"
"""Name of the phase before it in which the object is turned on the spot (asterisk-test.md)."""

REACHED = "reached"
LOST_CONTACT = "lost contact"
NO_GRASP = "no grasp"
TIME_OUT = "time out"
DIVERGED = "diverged"
STOPPED = "stopped"
OUTCOMES = (REACHED, LOST_CONTACT, NO_GRASP, TIME_OUT, DIVERGED, STOPPED)
"""How a trial can end; a sequence of primitives stops where one has failed too often, the object still held."""
LOST = (LOST_CONTACT, NO_GRASP, DIVERGED)
"""Those without the object in the hand."""


@dataclass(frozen=True)
class Passport:
    """Where a trial comes from: enough to run it again."""

    hand: HandSpec
    """The hand."""
    object: ObjectSpec
    """The object."""
    controller: str
    """Name of the controller that manipulates."""
    primitive: str
    """Name of the primitive."""
    angle_deg: float | None
    """Direction of the primitive [deg], None where it only rotates."""
    rotation_deg: float
    """Rotation to hold, or to reach where there is no direction [deg]."""
    path: str
    """Name of the reference path."""
    trial: int
    """Number of the trial in its direction, from 1."""
    seed: int
    """Seed of the run."""
    substeps: int
    """Physics steps between two rows."""
    timestep: float
    """Physics step [s]."""
    versions: dict[str, str]
    """Versions of this package and of what it ran on."""
    engine: str = "mujoco"
    """Physics engine."""
    limit: float | None = None
    """How far the hand could carry the object along the primitive [m], or turn it [rad]; None where unknown."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One recorded episode of T rows, in the palm frame and SI units."""

    passport: Passport
    """Where it comes from."""
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
    """Distance of each finger to the object `(T, 2)` [m]."""
    contact_links: NDArray[np.int64]
    """Link of each finger nearest to the object `(T, 2)`."""
    finger_points: Array
    """Nearest points of the fingers `(T, 2, 2)` [m]."""
    object_points: Array
    """Nearest points of the object `(T, 2, 2)` [m]."""
    reference: Array
    """The reference path `(S, 3)` relative to the start of manipulation, in palm axes [m, m, rad]."""

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
        """Whether each finger touches the object `(T, 2)`."""
        return self.gaps <= CONTACT_TOLERANCE

    def manipulated_path(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return positions `(M, 2)` [mm] from the start of manipulation, rotation `(M,)` [deg], and contact.

        The rotation counts from the grasp, so that a twist before manipulation is part of it. A trial whose grasp
        failed gives one row at the origin without contact.
        """
        rows = self.manipulation
        pose = planar(self.object_pose[rows])
        if len(pose) == 0:
            return np.zeros((1, 2)), np.zeros(1), np.zeros((1, 2), dtype=bool)
        before = planar(self.object_pose[self.grasped])[2]
        rotation = np.rad2deg(np.unwrap(pose[:, 2]) - pose[0, 2] + wrap_angle(pose[0, 2] - before))
        return 1e3 * (pose[:, :2] - pose[0, :2]), rotation, self.touching[rows]


_ARRAYS = tuple(f.name for f in fields(Trial) if f.name not in {"passport", "outcome", "phases"})


def save_trial(trial: Trial, path: Path) -> None:
    """Write a trial to a `.npz` file without pickles, under a temporary name that is then moved into place."""
    head = {
        "format": FORMAT,
        "outcome": trial.outcome,
        "phases": list(trial.phases),
        "passport": asdict(trial.passport),
    }
    arrays = {name: getattr(trial, name) for name in _ARRAYS}
    temporary = path.with_name(path.name + ".part")
    with temporary.open("wb") as file:
        np.savez_compressed(file, head=np.array(json.dumps(head)), **arrays)
    temporary.replace(path)


def load_trial(path: Path) -> Trial:
    """Return the trial of a `.npz` file.

    Raises:
        InputError: no file, not a trial, or a trial of another format.
    """
    if not path.is_file():
        raise InputError(f"no trial file {path}: give a .npz file from the `trials` folder of a run")
    try:
        with path.open("rb") as file, zipfile.ZipFile(file), np.load(file, allow_pickle=False) as data:
            head = json.loads(str(data["head"]))
            arrays = {name: data[name] for name in _ARRAYS} if head["format"] == FORMAT else {}
        if arrays:
            return Trial(_passport(head["passport"]), head["outcome"], tuple(head["phases"]), **arrays)
    except (KeyError, TypeError, ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(
            f"{path} is not a trial: {error}; give a .npz file from the `trials` folder of a run"
        ) from error
    raise InputError(f"{path} has trial format {head['format']}; this version reads {FORMAT}: run it again")


def hand_of(entry: dict[str, Any]) -> HandSpec:
    """Return the hand that `dataclasses.asdict` and JSON have made a dict of."""
    hand = dict(entry)
    for side in ("left", "right"):
        finger = hand[side]
        hand[side] = FingerSpec(
            tuple(finger["base"]),
            tuple(finger["links"]),
            tuple((low, high) for low, high in finger["limits"]),
            finger["bend"],
            _outlines(finger.get("outlines")),
            None if finger.get("masses") is None else tuple(finger["masses"]),
        )
    palm = _outlines(None if hand.get("palm") is None else [hand["palm"]])
    hand["palm"] = None if palm is None else palm[0]
    return HandSpec(**hand)


def object_of(entry: dict[str, Any]) -> ObjectSpec:
    """Return the object that `dataclasses.asdict` and JSON have made a dict of."""
    corners = tuple((x, y) for x, y in entry.get("corners", ()))
    return ObjectSpec(**(entry | {"size": tuple(entry["size"]), "corners": corners}))


def _passport(entry: dict[str, Any]) -> Passport:
    return Passport(**(entry | {"hand": hand_of(entry["hand"]), "object": object_of(entry["object"])}))


def _outlines(rows: list[list[list[float]]] | None) -> tuple[Corners, ...] | None:
    return None if rows is None else tuple(tuple((x, y) for x, y in corners) for corners in rows)

"""Drive a hand outside the simulator through two functions, one that reads and one that commands.

The phases are those of a simulated trial, each under its own controller, which sees what a hand can know. Decisions
are made at a fixed rate, only on joint angles that are new and while frames come in: else the hand holds
(`control/link.py`). All of it is NumPy; only a grasp that is not given is planned in simulation, before anything moves.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as Folder

import numpy as np
from numpy.typing import NDArray

from inhand.control.catalogue import CONTROLLERS, ControllerEntry, check_known, find_controller
from inhand.control.contract import check_rate, check_senses
from inhand.control.controller import Task
from inhand.control.episode import MANIPULATE
from inhand.control.joint import JointPid, PidConfig
from inhand.control.link import Clock, Command, DriveConfig, Link, Read, Row, StoppedError
from inhand.control.names import LEARNED
from inhand.control.phases import Grasp, Phase, placed_joints, standard_phases
from inhand.control.run_config import HeldConfig
from inhand.control.seen import SENSED
from inhand.control.trial import REACHED, TIME_OUT
from inhand.errors import InputError
from inhand.geometry import Array, Path, wrap_angle
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.shown import listed
from inhand.sim.disturbance import Disturbance
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.scene import SUBSTEPS
from inhand.tasks.paths import path_of, twist_poses, whole_path
from inhand.tasks.primitives import parse_directions

INTERRUPTED = "interrupted"
"""How driving ends where somebody stops it."""
ASTRAY = "out of place"
"""How it ends where the object is not where the hand is to take it: seen farther away than"""
PLACE = (0.02, 0.35)
"""these [m, rad]: guessed, five times what starts and biases of `field` differ by."""
OPEN = "open"
"""The phase before the thesis's three: from wherever the hand is to where simulated trials begin."""
SPARE = 0.3
"""Time for that beyond what the way takes [s]: guessed, for servos that lag."""
HELD = HeldConfig()
"""Hand and object where none are given."""


@dataclass(frozen=True, eq=False)
class Driven:
    """What driving a hand left."""

    outcome: str
    """How it ended: reached, time out, out of place, frames stopped, encoders stopped, no number or interrupted."""
    message: str
    """What a person should know of it."""
    rows: tuple[Row, ...]
    """Every command, with what was known then."""
    late: int
    """Periods that had passed before their turn came."""

    @property
    def moved(self) -> Array:
        """How far the object was carried, by the camera's frames alone `(3,)` [m, m, rad]; zero if it never was."""
        carried = [row.pose for row in self.rows if row.phase == MANIPULATE]
        way = carried[-1] - carried[0] if carried else np.zeros(3)
        return np.array([*way[:2], wrap_angle(way[2])])

    @property
    def held(self) -> int:
        """Commands that told the last targets again, as nothing new was there to decide on."""
        return sum(row.held for row in self.rows)

    def array(self, name: str) -> NDArray[np.float64] | NDArray[np.str_]:
        """Return a field of all rows: phase, time, joints, targets, pose, frame_time or held, `(T, ...)`."""
        return np.array([getattr(row, name) for row in self.rows])


def drive(
    read: Read,
    command: Command,
    *,
    direction: str | float = "Out",
    hand: str | Folder | HandSpec | None = None,
    object: str | Folder | ObjectSpec = HELD.object,
    controller: object = "ik-sensed",
    grasp: Grasp | None = None,
    senses: str | Disturbance | None = None,
    config: DriveConfig | None = None,
    clock: Clock | None = None,
) -> Driven:
    """Hold an object with a hand and carry it in a direction, until its way is gone or something is amiss.

    Whatever ends it, the hand was told targets last that hold the object, and is left so. Ctrl-C ends it too.

    Args:
        read: gives a `Reading`: joint angles and the frames that have come in, or None.
        command: takes joint targets `(n,)` [rad].
        direction: a word of `--directions`, or degrees counter-clockwise from +x.
        hand: a name, a TOML file or a spec; None for the one of a learned policy's contract, else the standard one.
        object: a name, a TOML file, an outline or a spec; it stands at the origin of the task frame.
        controller: one that reads what is sensed: ik-sensed, the folder of a policy, or a class of yours.
        grasp: joint angles `(1, n)` to hold the object in, and how far; None to plan it now.
        senses: what the hand senses and how late it obeys, as for `--disturb`; a learned policy's contract asks for it.
        config: rate, speed limit and patience.
        clock: what time it is, and how to wait.

    Raises:
        InputError: what cannot be driven, before anything is commanded; or readings that are none.
    """
    config, spec = config or DriveConfig(), load_object(object)
    entry, made = _suited(find_controller(CONTROLLERS.name_of(controller)), hand, spec)
    check_entry(entry, senses if isinstance(senses, Disturbance) else load_disturbance(senses or "none"), config)
    task, phases, placed = _asked((made, spec), entry, direction, grasp, config)
    link = Link(made, (read, command), config, clock or Clock())
    return _driven(link, task, phases, placed)


def _suited(
    entry: ControllerEntry, hand: str | Folder | HandSpec | None, spec: ObjectSpec
) -> tuple[ControllerEntry, HandSpec]:
    """Return the controller, of the policies of the package that for a hand and an object, and the hand."""
    own = HELD.hand if entry.contract is None else entry.contract.hand
    made = load_hand(own if hand is None else hand)
    return find_controller(entry.name, Held(made, spec)) if entry.name == LEARNED else entry, made


def check_entry(entry: ControllerEntry, senses: Disturbance | None, config: DriveConfig) -> None:
    """Refuse a controller that no hand can serve, and a policy with another rate or other senses than its contract's.

    Raises:
        InputError: the text says what differs.
    """
    if entry.reads != SENSED:
        raise InputError(
            f"controller {entry.name!r} reads what no hand can know, true poses and contacts: use ik-sensed, or a"
            " policy that reads what is sensed"
        )
    if entry.policy is None:
        return
    if entry.policy.contract is None:
        raise InputError(f"policy {entry.name!r} has no contract, so that nobody knows what it drives: train it again")
    check_rate(entry.policy.contract, 1.0 / config.rate_hz)
    if senses is None:
        raise InputError(
            f"policy {entry.name!r} learned with certain senses: say what this hand's are, as senses='my_hand.toml' in"
            " the form of --disturb (docs/real-hand.md)"
        )
    check_senses(entry.policy.contract, senses)


def _asked(
    held: tuple[HandSpec, ObjectSpec],
    entry: ControllerEntry,
    direction: str | float,
    grasp: Grasp | None,
    config: DriveConfig,
) -> tuple[Task, tuple[Phase, ...], Array]:
    """Return the task of one world, its phases, and the joint angles they begin in; plan a grasp if none is given."""
    hand, spec = held
    primitives = parse_directions(listed(direction))
    if len(primitives) != 1:
        raise InputError(
            f"direction {direction!r} is {len(primitives)} primitives: give one, a hand does one at a time"
        )
    path = path_of(primitives[0])
    whole = whole_path(path)[None]
    check_known(entry, Held(hand, spec), whole)
    if grasp is None:
        grasp = entry.grasp(hand, spec, hand.start_pose + whole)
    for name in ("opened", "closed"):
        angles = getattr(grasp, name)
        if angles.shape != (1, hand.n_joints):
            raise InputError(f"grasp.{name} has the shape {angles.shape}; it must be (1, {hand.n_joints}), one world")
    poses = Path(path.poses[None])
    # What was planned is the whole way; a twist before the path has its part of it.
    way = None if grasp.way is None else np.maximum(grasp.way - (Path(whole).length - poses.length), 0.0)
    timestep = 1.0 / config.rate_hz / SUBSTEPS
    phases = standard_phases(grasp, entry.manipulate, Path(twist_poses(path)[None]), config.longest)
    return Task(hand, (spec,), poses, timestep, distance=way), phases, placed_joints(hand, grasp)


def _driven(link: Link, task: Task, phases: Sequence[Phase], placed: Array) -> Driven:
    """Go through all phases, and say how that ended."""
    outcome, message = TIME_OUT, ""
    try:
        link.begin()
        _check_place(link.seen.frame_pose[0] - task.hand.start_pose)
        farthest = np.abs(placed - link.targets).max() / PidConfig.speed + SPARE
        opening = Phase(OPEN, lambda task: JointPid(task, placed), longest=float(farthest))
        for phase in (opening, *phases):
            link.phase = phase.name
            outcome = REACHED if _phase_done(link, task, phase) else TIME_OUT
    except StoppedError as stopped:
        outcome, message = stopped.outcome, str(stopped)
    except KeyboardInterrupt:
        link.hold()
        outcome = INTERRUPTED
        message = f"{INTERRUPTED} in phase {link.phase or 'none'}; the hand holds its last targets"
    if message:
        logging.getLogger(__name__).warning(message)
    return Driven(outcome, message, tuple(link.rows), link.late)


def _check_place(away: Array) -> None:
    """Refuse an object that is seen so far `(3,)` [m, m, rad] from where the grasp is planned for.

    Raises:
        StoppedError: it is farther than `PLACE`.
    """
    far, turned = float(np.linalg.norm(away[:2])), float(abs(wrap_angle(away[2])))
    if far > PLACE[0] or turned > PLACE[1]:
        raise StoppedError(
            ASTRAY,
            f"{ASTRAY}: the object is seen {1e3 * far:.0f} mm and {np.rad2deg(turned):.0f} deg from where the hand is"
            " to take it; the hand was told nothing. Put it at the origin of the task frame, then begin anew",
        )


def _phase_done(link: Link, task: Task, phase: Phase) -> bool:
    """Go through a phase, those before the object is carried for their whole time; return whether it was done."""
    controller = phase.controller(task)
    controller.begin(link.seen)
    for _ in range(round(phase.longest / task.control_period)):
        link.send(controller.act(link.seen)[0])
        link.look()
        if controller.finished(link.seen).all() and phase.keep_contact:
            return True
    return False

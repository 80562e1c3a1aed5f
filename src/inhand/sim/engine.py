"""What the rest of the toolkit asks of a physics engine, and what all engines refuse."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, centre_of_mass
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.names import Engine
from inhand.sim.scene import SceneSpec, scene_of_each
from inhand.sim.snapshot import Snapshot, check_indices, check_restore
from inhand.sim.state import State

Hand: TypeAlias = HandSpec | SpatialHand
"""A hand in the plane, or one in space."""
Body: TypeAlias = ObjectSpec | SolidSpec
"""What such a hand holds."""
LINK_SENSOR_SIZE = 7
"""Sensor values for every link and piece of the object: their distance, then the nearest points of both [m]."""


class Simulator(ABC):
    """B worlds, stepped together, each with its own object and surroundings.

    Everything in a `State` belongs to one instant. A world that diverges ends no batch: it is put back and told in
    `State.diverged`; the others go on as if nothing had happened.
    """

    engine: ClassVar[Engine]
    pose_size: ClassVar[int] = 3
    """Numbers of the pose in which an object is placed."""

    def __init__(
        self,
        hand: Hand | Sequence[Hand],
        objects: Sequence[Body],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Keep what all engines need: a hand and a scene for all kinds of worlds, or one each, and the object of each.

        `kinds` `(B,)` are the kinds of the worlds, which `restore` can change; without them there is a world of each.

        Raises:
            InputError: no objects, hands of different joints, or another number of hands or scenes.
        """
        each = scene_of_each(objects, scenes)
        self._kinds: list[tuple[Any, Any, SceneSpec]] = list(
            zip(_hand_of_each(hand, len(objects)), objects, each, strict=True)
        )
        self._kind = np.arange(len(objects)) if kinds is None else kinds.copy()
        count = len(self._kind)
        self.hand: Any = self._kinds[0][0]
        self.timestep = each[0].timestep
        """The first kind's hand, whose joints are those of all, and the physics step [s]."""
        self._mass, self._height, self._centre = np.zeros(count), np.zeros(count), np.zeros((count, 2))
        self._know(np.arange(count))
        self._diverged = np.zeros(count, dtype=bool)
        self._forces = np.zeros((count, len(self.hand.fingers), 3))
        self.lag = np.zeros(count, dtype=np.int64)
        """For how many physics steps of a control step each world still holds the targets before `(B,)`."""
        self._held = np.zeros((count, self.hand.n_joints))

    @property
    def objects(self) -> tuple[Any, ...]:
        """The object of each world."""
        return tuple(self._kinds[kind][1] for kind in self._kind.tolist())

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return len(self._kind)

    def reset(self, object_pose: Array, joint_angles: Array) -> State:
        """Place the objects `(B, 3)` upright on the plane and the joints `(B, n)`, all at rest; return the state.

        Hands in space have no plane: their objects are held at poses `(B, 7)` until they are let go.

        Raises:
            InputError: a pose or an angle is not finite, or their shapes are others; the text names the world.
        """
        count = self.n_worlds
        self._check_targets(joint_angles)
        if object_pose.shape != (count, self.pose_size):
            raise InputError(
                f"object poses of shape {object_pose.shape}; {count} worlds need {(count, self.pose_size)}"
            )
        if not np.isfinite(object_pose).all():
            world = np.argwhere(~np.isfinite(object_pose))[0, 0]
            needed = "x, y, theta" if self.pose_size == 3 else "numbers, a position and a quaternion"
            raise InputError(f"the object's start pose in world {world} is {object_pose[world]}; give finite {needed}")
        self._diverged[:], self._forces[:], self._held[:] = False, 0.0, joint_angles
        self._place(object_pose, joint_angles)
        return self.measure()

    def step(self, targets: Array, substeps: int, active: NDArray[np.bool_] | None = None) -> State:
        """Hold joint targets `(B, n)` [rad] for `substeps` physics steps; return the state after the last.

        Worlds that are not `active` `(B,)` stand still with their clocks, whatever their targets, and cost nothing.

        Raises:
            InputError: a target is not finite (the text names world and joint), or fewer than one physics step.
        """
        if substeps < 1:
            raise InputError(f"substeps {substeps}: a control step needs at least one physics step")
        self._check_targets(targets)
        active = np.ones(self.n_worlds, dtype=bool) if active is None else active
        self._hold(targets, substeps, active)
        return self._measure(active)

    def let_go(self, worlds: NDArray[np.bool_]) -> None:
        """Let go of objects that some worlds `(B,)` have held where they were placed; on a plane none is held."""
        del worlds

    def measure(self) -> State:
        """Return the state of the present instant, worlds that diverged put back first."""
        return self._measure(np.ones(self.n_worlds, dtype=bool))

    @abstractmethod
    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on, to put worlds back to it with `restore`."""

    def restore(
        self,
        worlds: NDArray[np.int64],
        snapshot: Snapshot,
        rows: NDArray[np.int64],
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Put worlds `(K,)` back to rows `(K,)` of a snapshot, without measuring; the others are not touched.

        They become worlds of the given `kinds` `(K,)`, or stay of their own.

        The snapshot may be another simulator's, of any number of worlds; a like object of another size or mass takes
        the pose over as it is.

        Raises:
            InputError: worlds or rows that are not there, a world named twice, or a hand of another number of joints.
        """
        check_restore(worlds, self.n_worlds, snapshot, rows, self.hand.n_joints)
        if kinds is not None:
            check_indices(kinds, len(self._kinds), "kind")
            self._kind[worlds] = kinds
            self._know(worlds)
            self._become(worlds)
        self._put(worlds, snapshot, rows)
        self._diverged[worlds], self._forces[worlds] = False, snapshot.forces[rows]
        self._held[worlds] = snapshot.ctrl[rows]

    def push(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        """Push the objects of worlds `(K,)` at their centres of mass with impulses `(K, 3)` [N s], at this instant.

        Raises:
            InputError: worlds that are not there, or impulses of another shape or not finite.
        """
        check_indices(worlds, self.n_worlds, "world")
        if impulse.shape != (len(worlds), 3) or not np.isfinite(impulse).all():
            raise InputError(
                f"impulses of shape {impulse.shape} for {len(worlds)} worlds; give finite values of shape"
                f" {(len(worlds), 3)} [N s]"
            )
        self._knock(worlds, impulse)

    @abstractmethod
    def _place(self, object_pose: Array, joint_angles: Array) -> None: ...

    def _hold(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        """Advance by physics steps, at first with the targets before where targets lag."""
        done = 0
        for until in np.unique([*self.lag[(self.lag > 0) & (self.lag < substeps)].tolist(), substeps]).tolist():
            self._advance(np.where((self.lag <= done)[:, None], targets, self._held), until - done, active)
            done = until
        self._held = np.where(active[:, None], targets, self._held)

    @abstractmethod
    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None: ...

    @abstractmethod
    def _measure(self, active: NDArray[np.bool_]) -> State:
        """Return the state of the present instant, of worlds that are not active as they were measured last."""

    @abstractmethod
    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None: ...

    @abstractmethod
    def _become(self, worlds: NDArray[np.int64]) -> None:
        """Take up that some worlds are of other kinds now; they are put somewhere next."""

    @abstractmethod
    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None: ...

    def _know(self, worlds: NDArray[np.int64]) -> None:
        """Write down what is asked of some worlds' objects at every step."""
        for world in worlds.tolist():
            spec = self._kinds[self._kind[world]][1]
            self._mass[world] = spec.mass
            if isinstance(spec, ObjectSpec):
                self._height[world], self._centre[world] = spec.height / 2, centre_of_mass(spec)

    def _state(
        self, time: Array, body: tuple[Array, Array], joints: tuple[Array, Array], targets: Array, links: Array
    ) -> State:
        """Return what is measured, in arrays of its own.

        Args:
            time: of each world `(B,)` [s].
            body: pose and velocity of the object `(B, 7)`, `(B, 6)`.
            joints: angles and velocities `(B, n)`.
            targets: last commanded `(B, n)`.
            links: of each its distance to the object and the nearest points of both `(B, n, 7)`.
        """
        nearest = np.stack([links[:, place, 0].argmin(axis=1) for place in self.hand.slices], axis=1)
        chosen = links[np.arange(len(time))[:, None], nearest + [place.start for place in self.hand.slices]]
        return State(
            time=time,
            object_pose=body[0],
            object_velocity=body[1],
            joint_angles=joints[0],
            joint_velocities=joints[1],
            targets=targets.copy(),
            link_gaps=links[..., 0].copy(),
            contact_links=nearest,
            finger_points=chosen[..., 1:4],
            object_points=chosen[..., 4:7],
            gaps=chosen[..., 0],
            forces=self._forces.copy(),
            diverged=self._diverged.copy(),
        )

    def _check_targets(self, targets: Array) -> None:
        wanted = self.n_worlds, self.hand.n_joints
        if targets.shape != wanted:
            raise InputError(f"joint targets of shape {targets.shape}; {wanted[0]} worlds need {wanted}")
        if not np.isfinite(targets).all():
            world, joint = np.argwhere(~np.isfinite(targets))[0]
            raise InputError(
                f"the target of joint {joint} in world {world} is {targets[world, joint]}; commands must be finite"
                " joint angles [rad]: look for a division by zero or a missing value in the controller"
            )


def _hand_of_each(hand: Hand | Sequence[Hand], n_worlds: int) -> tuple[Hand, ...]:
    hands = (hand,) * n_worlds if isinstance(hand, HandSpec | SpatialHand) else tuple(hand)
    if len(hands) != n_worlds:
        raise InputError(f"{len(hands)} hands for {n_worlds} objects; give one for all or one each")
    links = {tuple(len(finger.links) for finger in each.fingers) for each in hands}
    if len(links) > 1:
        given = " and ".join(str(each) for each in sorted(links))
        raise InputError(f"hands of {given} links in one simulator; use one simulator for each number")
    return hands

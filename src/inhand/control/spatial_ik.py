"""The expert in space: the planar expert's law, with forces that hold the object in place of a line between contacts.

Each control step moves a set point along the path and asks for the displacement and turn that feedback wants,

    d = kp e + ki integral(e) dt,   e = position and rotation from the object's pose to the set point's.

Errors are small, so a turn that passes 180 degrees is counted by its set point. The point of each fingertip that
touches is to move as the object there should, dx = d_x + d_w x (c - p), solved by damped least squares for the joints
from the measured contact, so that sliding and rolling are never fought. The forces f are those nearest to a grip along
the normals that lie in the friction cones and add up to what carries the weight:

    targets = q + DLS(J, dx) + (damping DLS(J, v) + J' f) / stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np

from inhand.control.controller import Controller, SpatialTask
from inhand.control.ik import Expert, LawConfig, finger_law
from inhand.control.spatial_follow import Ending, spatial_limit
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.following import FollowRules
from inhand.hands.spatial.forces import Grip, GripRules, hold
from inhand.hands.spatial.kinematics import place, point_jacobian
from inhand.rotations import carried, change_between, pose_from
from inhand.sim.state import State

SLOW = 1e-4
"""A set point that is slower stands still [m/s]."""
FREE_JOINTS = 3
"""A finger of more joints than this can move without moving its tip."""


@dataclass(frozen=True)
class SpatialIkConfig(LawConfig):
    """Numbers of the expert in space."""

    speed: float = 0.03
    """Speed of the set point along the path [m/s]; a turn counts as an arc at `TURN_ARM`."""
    grip: float = 2.5
    """Normal force that each contact would rather have with an object of up to `weight` [N]."""
    weight: float = 0.5
    """Weight from which on the grip grows [N],"""
    growth: float = 1.0
    """and by how much for each newton of weight more; friction alone would need half of that with three fingers."""
    least: float = 0.5
    """Least normal force of a contact [N]."""
    friction_share: float = 0.8
    """Share of the friction coefficient that the forces may use."""
    rounds: int = 20
    """Most rounds of the search for forces at a decision; it starts from those before."""
    integral_limit: tuple[float, float] = (0.008, 0.2)
    """Largest integral part of each axis [m] and of the rotation about it [rad]."""
    margin: tuple[float, float] = (0.002, 0.1)
    """Distance [m], and where the path turns the object angle [rad], kept from where the grip is predicted to end."""
    follow_share: float = 0.9
    """Share of the friction coefficient that the predicted grip may use."""
    closer: int = 3
    """Grasps that come closer to what they avoid and are tried out before, at most."""


EXPERT = SpatialIkConfig(proportional=4.0, integral=16.0, grip=2.0, margin=(0.002, 0.08), closer=8)
"""The numbers of `ik`. Tips resist spinning in proportion to how hard they press, which turns an object about which
they roll and then slips: with a lighter grip, and feedback that is stiffer, most grasps hold whose tips spin much. What
learned policies take over, and learned with, are the defaults."""


def grip_for(weight: Array, config: SpatialIkConfig) -> Array:
    """Return the grip for objects of some weights [N]: it grows with what it has to hold."""
    return np.asarray(config.grip + config.growth * np.maximum(weight - config.weight, 0.0))


def grips_of(task: SpatialTask, config: SpatialIkConfig) -> Array:
    """Return the grip in each world of a task `(B,)` [N]."""
    masses = np.array([spec.mass for spec in task.objects])
    return grip_for(masses * np.linalg.norm(task.gravity, axis=-1), config)


def ending_of(task: SpatialTask, config: SpatialIkConfig) -> Ending:
    """Return how the end of the grips is predicted: with the strongest, where objects differ in weight."""
    rules = FollowRules()
    grip = replace(rules.rules, grip=float(grips_of(task, config).max()), least=config.least)
    return Ending(replace(rules, rules=grip, share=config.follow_share), config.margin)


class SpatialIkController(Expert[SpatialIkConfig]):
    """Carries the object of every world along its path as far as its grip can follow, and holds it there."""

    def __init__(self, task: SpatialTask, config: SpatialIkConfig | None = None) -> None:
        """Carry objects along the task's paths."""
        super().__init__(task, config or SpatialIkConfig())
        self._task = task
        self.strayed, self.aside = np.zeros((2, task.n_worlds))
        """How far each object has been beside its path `(B,)` [m] while its set point moved, and with its end; a turn
        counts as an arc at `TURN_ARM`."""
        self.integral = np.zeros((task.n_worlds, 6))
        """Integral part of the wanted displacement `(B, 6)` [m, rad],"""
        self.forces: Grip | None = None
        """and the forces that were last wanted."""
        masses = np.array([spec.mass for spec in task.objects])
        self._grip = grips_of(task, self.config)
        self._friction = task.hand.friction * np.array([spec.friction for spec in task.objects])
        self._weight = np.concatenate([-masses[:, None] * task.gravity, np.zeros_like(task.gravity)], axis=-1)

    def take_over(self, before: Controller) -> None:
        """Go on with the forces and the integral part of the controller of its kind that has held the objects."""
        if isinstance(before, SpatialIkController):
            self.integral, self.forces = before.integral.copy(), before.forces

    def begin(self, state: State) -> None:
        """Start from the grip that holds the object now, and plan how far it can go."""
        known = self._task.distance
        ending = ending_of(self._task, self.config)
        self._set_off(spatial_limit(self._task, state, ending) if known is None else known)
        self._start, self._rest = self._task.origin(state), state.joint_angles
        self.strayed, self.aside = np.zeros((2, state.n_worlds))
        self._way = np.zeros((state.n_worlds, 6))
        self._moved, self._turned = self._task.path.at(self.progress)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        config, hand = self.config, self._task.hand
        step, velocity = self._wanted(state)
        inward, points, pose = state.normals, state.object_points, state.object_pose
        grip = self.forces = self._held_by((points, inward), pose)
        told, targets = place(hand, state.joint_angles), state.joint_angles.copy()
        for i, own in enumerate(hand.slices):
            angles, point = state.joint_angles[:, own], points[:, i]
            jacobian = point_jacobian(told.places[:, own], told.axes[:, own], point)
            arm = point - pose[:, :3]
            closer = np.maximum(state.gaps[:, i], 0.0)[:, None] * inward[:, i]
            spare = angles.shape[1] > FREE_JOINTS
            posture = config.posture * (self._rest[:, own] - angles) if spare else None
            moves = carried(step, arm) + closer, carried(velocity, arm)
            targets[:, own] += finger_law(hand, jacobian, moves, grip.forces[:, i], config.damping, posture=posture)
        return targets

    def _held_by(self, contacts: tuple[Array, Array], pose: Array) -> Grip:
        """Return the forces that carry the weight at the contacts."""
        config = self.config
        rules = GripRules(least=config.least, rounds=config.rounds)
        friction, wanted = config.friction_share * self._friction, (self._weight, pose[:, :3])
        return hold(contacts, *wanted, rules=rules, before=self.forces, grip=self._grip, friction=friction)

    def _wanted(self, state: State) -> tuple[Array, Array]:
        """Move the set point; return the wanted displacement of the object and its velocity, each `(B, 6)`."""
        config, moved, turned = self.config, self._moved, self._turned
        before = self._error(state, moved, turned)
        self._go_on(np.linalg.norm(before[:, :3], axis=-1) + TURN_ARM * np.linalg.norm(before[:, 3:], axis=-1))
        self._moved, self._turned = self._task.path.at(self.progress)
        error = self._error(state, self._moved, self._turned)
        self.integral = self._summed(self.integral, error, np.repeat(config.integral_limit, 3))
        velocity = np.concatenate([self._moved - moved, self._turned - turned], axis=-1) / self._period
        self.strayed = np.maximum(self.strayed, beside(error, velocity))
        self._way = np.where(np.abs(velocity).max(axis=-1, keepdims=True) > SLOW, velocity, self._way)
        self.aside = np.maximum(self.aside, beside(error, self._way))
        return config.proportional * error + self.integral, velocity

    def _error(self, state: State, moved: Array, turned: Array) -> Array:
        """Return how far set points are from the objects, and turned from them `(B, 6)` [m, rad]."""
        return change_between(state.object_pose, pose_from(self._start, moved, turned))


def beside(error: Array, velocity: Array) -> Array:
    """Return the length `(B,)` [m] of errors `(B, 6)` across the way of set points, of velocities `(B, 6)`.

    Rotations count as arcs at `TURN_ARM`; where a set point stands still nothing is across.
    """
    arms = np.repeat([1.0, TURN_ARM], 3)
    off, way = error * arms, velocity * arms
    size = np.linalg.norm(way, axis=-1, keepdims=True)
    way = way / np.maximum(size, 1e-12)
    across = np.linalg.norm(off - (off * way).sum(axis=-1, keepdims=True) * way, axis=-1)
    return np.where(size[:, 0] > SLOW, across, 0.0)

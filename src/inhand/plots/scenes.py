"""A hand and an object as outlines to draw."""

from inhand.geometry import Array, transform
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import hand_positions
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.shapes import link_polygons, palm_outline
from inhand.plots.shapes import SceneOutline


def scene_of(hand: HandSpec, spec: ObjectSpec, joints: Array, pose: Array, origin: Array) -> SceneOutline:
    """Return a hand at joint angles `(n_joints,)` [rad] and an object at a pose `(3,)`, drawn around an origin [m]."""
    links: list[Array] = []
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        links += link_polygons(hand, finger, joints[place])
    body = transform(pose, polygon(spec))
    return SceneOutline(
        links=tuple(1e3 * link for link in links),
        palm=1e3 * palm_outline(hand),
        object=1e3 * body,
        joints=1e3 * hand_positions(hand, joints),
        origin_mm=1e3 * origin,
        fingers=hand.finger_names,
    )

"""A trial as a recording for Rerun's viewer: hand, object, contacts and forces in space, and signals over time."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from inhand.control.replays import phases_of
from inhand.control.spatial_scenes import box_faces, faces_of, rods_at
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import AnyTrial, Trial
from inhand.errors import needs_extra
from inhand.folders import in_place
from inhand.geometry import Array, inverse_quaternion, spatial
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import joint_positions, link_angles
from inhand.hands.objects import convex_pieces
from inhand.hands.shapes import link_outline, palm_outline
from inhand.rotations import multiply, vector_of

try:
    import rerun
    import rerun.blueprint as layout
except ImportError as error:
    raise needs_extra("rerun", "a recording for Rerun") from error

TIMELINE = "time"
"""Seconds since manipulation began."""
NEWTON_M = 0.01
"""Length of the arrow of a newton [m]."""
DOT_M = 0.0015
"""Radius of the dot of a contact [m]."""
PALM, LINK, OBJECT = 0x8A949EFF, 0xBCC6CFFF, 0xF5A742A0
TOUCH, FORCE, TARGET = 0x1A7F37FF, 0xD1242FFF, 0x0969DAFF
SIGNALS = ("object_mm", "turn_deg", "force_n", "gap_mm", "overlap_mm", "angle_deg", "target_deg")
"""What is drawn over time, a panel each."""


@dataclass(frozen=True, eq=False)
class Body:
    """Something rigid."""

    name: str
    shape: Any
    """It in its own frame, as Rerun draws it."""
    poses: Array
    """Of its frame in the palm's `(T, 7)`, or `(1, 7)` where it stands still."""


def write_recording(trial: AnyTrial, out: Path, *, show: bool) -> None:
    """Write a trial as a .rrd file, which appears whole or not at all, and show it in Rerun's viewer if asked to."""
    both = layout.Horizontal(
        layout.Vertical(
            layout.Spatial3DView(origin="hand", name="hand and object"),
            layout.TextLogView(origin="phases", name="phases"),
            row_shares=[4, 1],
        ),
        layout.Vertical(
            *(layout.TimeSeriesView(origin=f"signals/{name}", name=name.replace("_", " ")) for name in SIGNALS)
        ),
    )
    with in_place(out) as part:
        stream = rerun.RecordingStream("inhand", send_properties=False)
        sinks = [rerun.FileSink(part)]
        if show:
            rerun.spawn(connect=False)
            sinks.append(rerun.GrpcSink())
        stream.set_sinks(*sinks, default_blueprint=layout.Blueprint(both, collapse_panels=True))
        _log(stream, trial)
        stream.flush()
        stream.disconnect()


def _log(stream: rerun.RecordingStream, trial: AnyTrial) -> None:
    start = trial.onset
    time = rerun.TimeColumn(TIMELINE, duration=trial.time - trial.time[start])

    def columns(place: str, found: rerun.ComponentColumnList, when: rerun.TimeColumn = time) -> None:
        stream.send_columns(place, indexes=[when], columns=found)

    stream.log("hand", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for body in _bodies(trial):
        place = f"hand/{body.name}"
        stream.log(place, body.shape, static=True)
        # Rerun has the real part of a quaternion last.
        position, turned = body.poses[:, :3], np.roll(body.poses[:, 3:], -1, axis=1)
        if len(body.poses) == 1:
            stream.log(place, rerun.Transform3D(translation=position[0], quaternion=turned[0]), static=True)
        else:
            columns(place, rerun.Transform3D.columns(translation=position, quaternion=turned))
    stream.log("hand/target", rerun.LineStrips3D([_target(trial, start)], colors=[TARGET]), static=True)
    for number, finger in enumerate(trial.passport.hand.finger_names):
        name = _plain(finger)
        touching = np.where(trial.touching[:, number], DOT_M, 0.0)
        dots = rerun.Points3D.columns(positions=trial.finger_points[:, number], radii=touching)
        arrows = {"origins": trial.object_points[:, number], "vectors": NEWTON_M * trial.forces[:, number]}
        columns(f"hand/contacts/{name}", dots)
        columns(f"hand/forces/{name}", rerun.Arrows3D.columns(**arrows))
        stream.log(f"hand/contacts/{name}", rerun.Points3D.from_fields(colors=[TOUCH]), static=True)
        stream.log(f"hand/forces/{name}", rerun.Arrows3D.from_fields(colors=[FORCE]), static=True)
    for name, (told, values) in _signals(trial, start).items():
        stream.log(f"signals/{name}", rerun.SeriesLines(names=told), static=True)
        scalars = rerun.Scalars.columns(scalars=values.ravel())
        columns(f"signals/{name}", scalars.partition([values.shape[1]] * len(values)))
    rows, names = zip(*phases_of(trial, 1), strict=True)
    at = trial.time[[*rows, -1]] - trial.time[start]
    columns("phases", rerun.TextLog.columns(text=[*names, trial.outcome]), rerun.TimeColumn(TIMELINE, duration=at))


def _bodies(trial: AnyTrial) -> Iterator[Body]:
    """Give palm, links and object of a trial."""

    def solid(name: str, faces: Sequence[Array], poses: Array, colour: int) -> Body:
        return Body(name, _mesh(faces, colour), poses)

    if isinstance(trial, SpatialTrial):
        hand, still = trial.passport.hand, np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
        yield solid("palm", box_faces(hand.palm), still, PALM)
        rods, whose = rods_at(hand, trial.joint_angles)
        for number, finger in enumerate(whose.tolist()):
            start, end, radius = np.split(rods[:, number], [3, 6], axis=1)
            size = float(np.linalg.norm(end[0] - start[0]))
            shape = rerun.Capsules3D(lengths=[size], radii=[radius[0, 0]], colors=[LINK])
            name = f"{_plain(hand.finger_names[finger])}/{number}"
            yield Body(name, shape, np.concatenate([start, _along(end - start)], axis=1))
        yield solid("object", faces_of(trial.passport.object), trial.object_pose, OBJECT)
        return
    yield from (solid(name, faces, poses, colour) for name, faces, poses, colour in _prisms(trial))


def _prisms(trial: Trial) -> Iterator[tuple[str, list[Array], Array, int]]:
    """Give name, faces, poses and colour of what stands upright: palm, links and object of a trial in the plane."""
    hand, spec = trial.passport.hand, trial.passport.object
    middle = spec.height / 2
    yield "palm", _prism(palm_outline(hand), hand.thickness), spatial(np.zeros((1, 3)), middle), PALM
    for name, finger, place in zip(hand.finger_names, hand.fingers, hand.slices, strict=True):
        angles = trial.joint_angles[:, place]
        joints, turned = joint_positions(finger, angles), link_angles(angles)
        for link in range(len(finger.links)):
            poses = spatial(np.concatenate([joints[:, link], turned[:, link, None]], axis=1), middle)
            yield f"{_plain(name)}/{link}", _prism(link_outline(hand, finger, link), hand.thickness), poses, LINK
    faces = [face for piece in convex_pieces(spec) for face in _prism(piece, spec.height)]
    yield "object", faces, trial.object_pose, OBJECT


def _prism(outline: Array, height: float) -> list[Array]:
    """Return the faces `(K, 3)` [m] of an upright prism over a convex outline `(K, 2)`, its middle at 0."""
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in (-height / 2, height / 2))
    sides = [np.stack([low[k - 1], low[k], high[k], high[k - 1]]) for k in range(len(outline))]
    return [*sides, high, low[::-1]]


def _mesh(faces: Sequence[Array], colour: int) -> rerun.Mesh3D:
    """Return convex faces `(K, 3)` [m] as triangles, flat: no corner is shared."""
    corners: list[Array] = []
    triangles, normals = [], []
    for face in faces:
        first = sum(len(each) for each in corners)
        triangles += [(first, first + k, first + k + 1) for k in range(1, len(face) - 1)]
        across = np.cross(face[1] - face[0], face[2] - face[0])
        normals.append(np.tile(across / np.linalg.norm(across), (len(face), 1)))
        corners.append(face)
    shape = {"vertex_positions": np.concatenate(corners), "vertex_normals": np.concatenate(normals)}
    return rerun.Mesh3D(**shape, triangle_indices=triangles, albedo_factor=colour)


def _along(vectors: Array) -> Array:
    """Return quaternions `(T, 4)` that turn z along vectors `(T, 3)`; any for one without length."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    x, y, z = (vectors / np.maximum(size, 1e-12)).T
    found = np.column_stack([1 + z, -y, x, np.zeros_like(z)])
    found[z < -1 + 1e-9] = (0.0, 1.0, 0.0, 0.0)
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _target(trial: AnyTrial, start: int) -> Array:
    """Return the path that the object was to take `(S, 3)` [m]."""
    moved = trial.reference[:, : 3 if isinstance(trial, SpatialTrial) else 2]
    place = np.tile(trial.object_pose[start, :3], (len(moved), 1))
    place[:, : moved.shape[1]] += moved
    return place


def _signals(trial: AnyTrial, start: int) -> dict[str, tuple[Sequence[str], Array]]:
    """Return names and values `(T, K)` of each of `SIGNALS`, moves and turns since manipulation began."""
    hand = trial.passport.hand
    pose, fingers = trial.object_pose, hand.finger_names
    turned = vector_of(multiply(pose[:, 3:], inverse_quaternion(pose[start : start + 1, 3:])))
    counts = [range(1, place.stop - place.start + 1) for place in hand.slices]
    joints = [f"{name}, {k}" for name, count in zip(fingers, counts, strict=True) for k in count]
    kept = [2] if isinstance(hand, HandSpec) else [0, 1, 2]
    return {
        "object_mm": (["x", "y", "z"], 1e3 * (pose[:, :3] - pose[start, :3])),
        "turn_deg": (["xyz"[k] for k in kept], np.rad2deg(np.unwrap(turned[:, kept], axis=0))),
        "force_n": (fingers, np.linalg.norm(trial.forces, axis=-1)),
        "gap_mm": (fingers, 1e3 * trial.gaps),
        "overlap_mm": (["deepest"], 1e3 * trial.penetration[:, None]),
        "angle_deg": (joints, np.rad2deg(trial.joint_angles)),
        "target_deg": (joints, np.rad2deg(trial.targets)),
    }


def _plain(name: str) -> str:
    """Return a finger's name as a part of a path of Rerun's, in which spaces and most marks have a meaning."""
    return re.sub(r"\W", "_", name)

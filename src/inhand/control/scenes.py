"""Hand and object of a trial as outlines to draw."""

from inhand.control.trial import Trial
from inhand.geometry import Array, planar
from inhand.plots.scenes import scene_of
from inhand.plots.shapes import SceneOutline


def scene_at(trial: Trial, row: int, origin: Array) -> SceneOutline:
    """Return hand and object of one row, drawn around `origin` `(2,)` [m] in the palm frame."""
    pose = planar(trial.object_pose[row])
    return scene_of(trial.passport.hand, trial.passport.object, trial.joint_angles[row], pose, origin)


def start_scene(trial: Trial) -> SceneOutline:
    """Return hand and object at the start of manipulation."""
    row = trial.onset
    return scene_at(trial, row, trial.object_pose[row, :2])

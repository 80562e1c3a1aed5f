"""What `--path` names: a drawing, of a hand in the plane or in space, or a task."""

from inhand.errors import InputError, near_matches
from inhand.tracing.drawing import Drawing
from inhand.tracing.drawings import SHAPES, find_drawing
from inhand.tracing.tasks import TASKS


def find_path(text: str, *, space: bool = False) -> Drawing:
    """Return the drawing that `--path` names, of a hand in the plane or in space.

    Raises:
        InputError: there is none; the text offers near matches, tasks among them.
    """
    tasks, shapes, planes, find = tuple(TASKS), tuple(SHAPES), "", find_drawing
    if space:
        from inhand.tracing.spatial_drawings import HELIX, PLANES, find_spatial_drawing
        from inhand.tracing.spatial_tasks import SPATIAL_TASKS

        tasks, shapes, find = tuple(SPATIAL_TASKS), (*SHAPES, HELIX), find_spatial_drawing
        planes = f", each in a plane as A@xz ({', '.join(PLANES)}), joined by +"
    try:
        return find(text)
    except InputError as error:
        if "unknown drawing" not in str(error):
            raise
        raise InputError(
            f"unknown --path {text!r}{near_matches(text, (*tasks, *shapes))}; allowed are {', '.join(shapes)}, a letter"
            f" A to Z, an .svg, .dxf or .csv file{planes}, and the tasks {', '.join(tasks)}"
        ) from error


def check_path(text: str) -> None:
    """Refuse what is no drawing or task of a hand in the plane.

    Raises:
        InputError: as in `find_path`, or a file of the user's without such a task.
    """
    if TASKS.find(text) is None:
        find_path(text)

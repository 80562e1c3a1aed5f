"""One recorded trial, as the reader hands it over."""

from dataclasses import dataclass

from inhand.asterisk_test.people.human_rows import ALL_SEEN, Unseen
from inhand.geometry import Array


@dataclass(frozen=True, eq=False)
class HumanTrial:
    """One recorded trial in mm and degrees, x right and y away from the palm."""

    source: str
    subject: str
    """The person, or the controller."""
    hand: str
    """Name of the hand, such as `2v2`."""
    direction: str
    """Letter of the direction, `a` to `h`, or `n` for a trial that only rotates."""
    primitive: str
    """Thesis name of the direction, or `cw` or `ccw`."""
    angle_deg: float | None
    """Direction counter-clockwise from +x [deg], None for a trial that only rotates."""
    twist_deg: float
    """Rotation to hold while translating, counter-clockwise [deg]: 0, -15 (p15) or 15 (m15)."""
    trial: int
    unit: str
    """The unit that was assumed for the file."""
    frame: Array
    """Frame number of each row `(T,)`; the camera drops frames, and nominal 30 Hz is no clock."""
    start_mm: Array
    """Position `(2,)` of the first row in the file's own frame [mm]."""
    path_mm: Array
    """Positions `(T, 2)` relative to the first row [mm], as recorded."""
    rotation_deg: Array
    """Rotation `(T,)` [deg], counter-clockwise where `rotation_signed`, NaN where not `rotation_usable`."""
    rotation_signed: bool
    """Whether the label tells the sign; otherwise `rotation_deg` is a size, never negative."""
    rotation_usable: bool
    """False for the thesis's controller files, whose rotation column means nothing."""
    filtered_mm: Array
    """Positions `(T, 2)` smoothed without lag, in the frame of `path_mm` [mm]; metrics use these."""
    filtered_rotation_deg: Array
    """Rotation `(T,)` smoothed the same way [deg]."""
    moving: tuple[int, int]
    """First row and one past the last row of the movement, without leading zero rows and a frozen tail."""
    unseen: Unseen = ALL_SEEN
    """Frames in which the camera did not see the object, and what became of them."""

"""A replay shows every instant, is small, the same every time, and says what it cannot write."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.plots.replay import write_replay
from inhand.plots.shapes import SceneOutline

FRAMES = 12


def outline_at(x: float) -> SceneOutline:
    """Return a still finger and palm, and a 39 mm square that moved to `x` [mm]."""
    corners = np.array([(-19.5, -19.5), (19.5, -19.5), (19.5, 19.5), (-19.5, 19.5)])
    palm = np.array([(-26.5, -53.0), (26.5, -53.0), (26.5, 0.0), (-26.5, 0.0)])
    finger = np.array([(-41.0, 0.0), (-19.5, 0.0), (-19.5, 93.0), (-41.0, 93.0)])
    return SceneOutline((finger,), palm, corners + np.array([x, 93.6]), np.array([(-30.0, 0.0)]), np.array([0.0, 93.6]))


@pytest.fixture(scope="module")
def frames() -> list[SceneOutline]:
    return [outline_at(x) for x in np.linspace(0, 80, FRAMES)]


@pytest.fixture(scope="module")
def trail() -> Array:
    return np.column_stack([np.linspace(0, 80, FRAMES), np.zeros(FRAMES)])


@pytest.fixture(scope="module")
def contact() -> NDArray[np.bool_]:
    return np.arange(2 * FRAMES).reshape(FRAMES, 2) % 7 > 0


def pixels(path: Path, frame: int) -> NDArray[np.uint8]:
    with Image.open(path) as picture:
        picture.seek(frame)
        return np.asarray(picture.convert("RGB"))


def columns_near(picture: NDArray[np.uint8], colour: tuple[int, int, int], distance: int = 25) -> NDArray[np.intp]:
    """Return the columns of a picture that hold a pixel near a colour."""
    apart = np.abs(picture.astype(int) - colour).max(axis=2)
    return np.flatnonzero((apart < distance).any(axis=0))


def test_gif_holds_every_instant_on_white(
    tmp_path: Path, frames: list[SceneOutline], trail: Array, contact: NDArray[np.bool_]
) -> None:
    out = write_replay(frames, trail, tmp_path / "new" / "a.gif", title="Right", target_angle_deg=0.0, contact=contact)
    with Image.open(out) as picture:
        assert getattr(picture, "n_frames", 1) == FRAMES
        assert picture.size == (480, 480)
        assert picture.info["loop"] == 0
        durations = []
        for index in range(FRAMES):
            picture.seek(index)
            durations.append(picture.info["duration"])
    assert durations == [40] * (FRAMES - 1) + [1000]
    assert tuple(pixels(out, 0)[2, 2]) == tuple(pixels(out, FRAMES - 1)[2, 2]) == (255, 255, 255)
    assert out.stat().st_size < 300_000
    assert [path.name for path in out.parent.iterdir()] == ["a.gif"]


def test_object_moves_and_trail_grows_in_the_colour_of_the_direction(
    tmp_path: Path, frames: list[SceneOutline], trail: Array
) -> None:
    out = write_replay(frames, trail, tmp_path / "a.gif", target_angle_deg=0.0)
    objects = [columns_near(pixels(out, index), (245, 194, 107)) for index in (0, FRAMES - 1)]
    assert objects[0].min() + 50 < objects[1].min()
    red = [len(columns_near(pixels(out, index), (214, 39, 40))) for index in (0, FRAMES // 2, FRAMES - 1)]
    assert red[0] < 10 < red[1] < red[2]


def test_same_trial_gives_the_same_bytes(tmp_path: Path, frames: list[SceneOutline], trail: Array) -> None:
    first, second = (write_replay(frames, trail, tmp_path / name, title="Right") for name in ("a.gif", "b.gif"))
    assert first.read_bytes() == second.read_bytes()


def test_a_given_target_path_is_drawn(tmp_path: Path, frames: list[SceneOutline], trail: Array) -> None:
    plain = write_replay(frames, trail, tmp_path / "plain.gif")
    path = np.array([(0.0, 0.0), (40.0, -20.0), (80.0, 0.0)])
    bent = write_replay(frames, trail, tmp_path / "bent.gif", target_path_mm=path)
    assert (pixels(plain, 0) != pixels(bent, 0)).any()


def test_one_frame_and_a_gap_in_the_trail_are_ordinary(
    tmp_path: Path, frames: list[SceneOutline], trail: Array
) -> None:
    alone = write_replay(frames[:1], trail[:1], tmp_path / "one.gif", target_angle_deg=90.0)
    gap = trail.copy()
    gap[3] = np.nan
    gapped = write_replay(frames, gap, tmp_path / "gap.gif", target_angle_deg=0.0)
    with Image.open(alone) as one, Image.open(gapped) as all_of_them:
        assert getattr(one, "n_frames", 1) == 1
        assert getattr(all_of_them, "n_frames", 1) == FRAMES


def test_mp4_goes_through_the_program_on_the_path(
    tmp_path: Path, frames: list[SceneOutline], trail: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n')
    program.chmod(0o700)
    monkeypatch.setenv("PATH", str(program.parent))
    out = write_replay(frames, trail, tmp_path / "a.mp4", target_angle_deg=0.0)
    raw = np.frombuffer(out.read_bytes(), dtype=np.uint8).reshape(FRAMES, 480, 480, 4)
    assert (raw[0] != raw[-1]).any()
    corner = raw[:, 10:30, 420:470, :3]
    assert (corner < 128).any(axis=(1, 2, 3)).all(), "the counter is missing in the film"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mp4", "bin"]


def test_mp4_without_the_program_says_what_to_do(
    tmp_path: Path, frames: list[SceneOutline], trail: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    wanted = r"cannot write 'a.mp4': .mp4 needs the ffmpeg program .* install it or write 'a.gif' instead"
    with pytest.raises(InputError, match=wanted):
        write_replay(frames, trail, tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_input_that_cannot_be_replayed(tmp_path: Path, frames: list[SceneOutline], trail: Array) -> None:
    gif = tmp_path / "a.gif"
    with pytest.raises(InputError, match=r"cannot write a replay as 'a.avi': the suffix must be .gif or .mp4"):
        write_replay(frames, trail, tmp_path / "a.avi")
    with pytest.raises(InputError, match="a replay was given no frame: give one SceneOutline per instant"):
        write_replay([], trail, gif)
    with pytest.raises(InputError, match=f"5 trail points given for {FRAMES} frames"):
        write_replay(frames, trail[:5], gif)
    with pytest.raises(InputError, match=f"3 rows of contact given for {FRAMES} frames"):
        write_replay(frames, trail, gif, contact=np.ones((3, 2), dtype=bool))
    with pytest.raises(InputError, match="60 frames per second given: the rate must be above 0 and at most 50"):
        write_replay(frames, trail, gif, fps=60)
    with pytest.raises(InputError, match=r"target path has shape \(3,\)"):
        write_replay(frames, trail, gif, target_path_mm=np.zeros(3))
    assert list(tmp_path.iterdir()) == []

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image, ImageSequence

from envs.animation import write_gif


def pictures(count: int) -> list[npt.NDArray[np.uint8]]:
    """A red bar that grows."""
    frames = []
    for width in range(count):
        frame = np.full((40, 60, 3), 255, dtype=np.uint8)
        frame[:, : 5 * width + 5] = [200, 0, 0]
        frames.append(frame)
    return frames


def test_animation_holds_every_frame_and_rests_on_the_last(tmp_path: Path) -> None:
    path = tmp_path / "bar.gif"
    write_gif(path, pictures(6), 0.1)
    with Image.open(path) as animation:
        assert animation.n_frames == 6  # type: ignore[attr-defined]  # of GIFs
        assert animation.size == (60, 40)
        frames, durations = [], []
        for frame in ImageSequence.Iterator(animation):
            frames.append(np.asarray(frame.convert("RGB")))
            durations.append(frame.info["duration"])
    assert durations == [100] * 5 + [2000]
    for written, drawn in zip(frames, pictures(6), strict=True):
        np.testing.assert_array_equal(written, drawn)
    assert all((first != second).any() for first, second in pairwise(frames))


def test_an_animation_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="expected at least one picture, got none"):
        write_gif(tmp_path / "nothing.gif", [], 0.1)

"""Animated GIFs of pictures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

# Enough for flat colours and their smoothed edges.
NUM_COLOURS = 64
NUM_SAMPLES = 8
"""Frames that the palette is made from, about."""
REST = 2.0
"""How long the last frame is shown, in s."""


def write_gif(path: Path, frames: Iterable[npt.NDArray[np.uint8]], frame_time: float) -> None:
    """Write an animated GIF that runs for ever and rests on its last frame.

    Args:
        path: File to write.
        frames: RGB pictures of one size, at least one, each of shape (height, width, 3).
        frame_time: Time each frame is shown, in s.

    Raises:
        ValueError: If there is no frame.
    """
    shown = list(frames)
    if not shown:
        raise ValueError("frames: expected at least one picture, got none")
    # One palette for all frames keeps what stands still bit for bit the same, so that it costs nothing in the file.
    # Some colours come and go, so it is made from frames of the whole time; this method keeps white white.
    sample = np.concatenate([*shown[:: max(1, len(shown) // NUM_SAMPLES)], shown[-1]])
    palette = Image.fromarray(sample).quantize(NUM_COLOURS, method=Image.Quantize.MAXCOVERAGE)
    pictures = [Image.fromarray(frame) for frame in shown]
    indexed = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    milliseconds = round(1000.0 * frame_time)
    indexed[0].save(
        path,
        save_all=True,
        append_images=indexed[1:],
        duration=[milliseconds] * (len(indexed) - 1) + [round(1000.0 * REST)],
        loop=0,
        optimize=False,
    )

"""Animated GIFs of pictures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

# Enough for flat colours and their smoothed edges.
NUM_COLOURS = 64
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
    # The last frame holds every colour: full trails, and crosses if there are any. One palette for all frames
    # keeps what stands still bit for bit the same, so that it costs nothing in the file.
    pictures = [Image.fromarray(frame) for frame in frames]
    if not pictures:
        raise ValueError("frames: expected at least one picture, got none")
    palette = pictures[-1].quantize(NUM_COLOURS)
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

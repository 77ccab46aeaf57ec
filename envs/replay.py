"""Replay: ``python -m envs.replay episode.jsonl`` draws a recorded episode, as an animated GIF or as a figure.

A name that ends in ``.gif`` becomes an animation, one that ends in ``.png`` a figure of all trajectories.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console

from envs.animation import write_gif
from envs.brush import Canvas
from envs.layers import Layers
from envs.recording import Recording
from envs.recording_file import RecordingFileError, read_recording
from envs.rendering import side_by_side
from envs.trajectory_figure import write_trajectories
from safefilter.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class Settings:
    """Draw a recorded episode.

    Attributes:
        recording: File that an environment with ``record=`` wrote.
        out: Picture to write, ``.gif`` or ``.png``; without it the recording's name with ``.gif``.
        size: Width of the animation, in px.
        every: Show each so manieth step only.
        speed: Times faster than it was.
        beams: Draw so many beams of each robot's lidar.
        areas: Draw social norm areas.
        may_be_cut: Take a recording that ends before its episode did.
    """

    recording: Annotated[Path, tyro.conf.Positional]
    out: Path | None = None
    size: int = 480
    every: int = 2
    speed: float = 4.0
    beams: int = 0
    areas: bool = False
    may_be_cut: bool = False


def main(settings: Settings, console: Console) -> int:
    """Read the recording and write the picture.

    Args:
        settings: What to draw.
        console: Where to say what was written, or what is wrong.

    Returns:
        0, or 1 if the recording cannot be read.

    Raises:
        InvalidInput: If the picture is to be of another kind.
    """
    out = settings.recording.with_suffix(".gif") if settings.out is None else settings.out
    if out.suffix not in {".gif", ".png"}:
        raise InvalidInput(f"out: expected a name that ends in .gif or .png, got {out}")
    try:
        recording = read_recording(settings.recording, may_be_cut=settings.may_be_cut)
    except RecordingFileError as error:
        console.print(str(error), style="red", highlight=False, markup=False)
        return 1
    if out.suffix == ".png":
        write_trajectories(out, [(recording.setting.scenario, recording)])
    else:
        _write_animation(out, recording, settings)
    console.print(f"wrote {out} ({out.stat().st_size / 1e6:.1f} MB)", highlight=False)
    return 0


def _write_animation(out: Path, recording: Recording, settings: Settings) -> None:
    canvas = Canvas(settings.size, half_extent_of(recording))
    layers = Layers(num_beams=settings.beams, has_areas=settings.areas)
    last = recording.num_moments - 1
    moments = [*range(0, last, settings.every), last]
    titled = [(recording.setting.scenario, recording)]
    frames = (side_by_side(titled, moment, canvas, layers) for moment in moments)
    write_gif(out, frames, frame_time=settings.every * recording.setting.dt / settings.speed)


def half_extent_of(recording: Recording) -> float:
    """Half the side of a square around the origin that holds everything that the recording shows, in m."""
    setting = recording.setting
    places = (setting.walls.ravel(), setting.goal.ravel(), recording.position.ravel())
    return float(max(np.abs(part).max(initial=0.0) for part in places))


if __name__ == "__main__":
    raise SystemExit(main(tyro.cli(Settings), Console()))

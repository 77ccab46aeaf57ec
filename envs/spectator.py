"""Spectator: whoever watches one world from outside, to show it or to record it.

Letters: N robots.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from envs.agents import Step
from envs.layers import Layers
from envs.navigation import Navigation
from envs.recording import Moment, Recorder, Setting
from envs.recording_file import SUFFIX, RecordingWriter
from safefilter.errors import InvalidInput

if TYPE_CHECKING:
    from envs.window import Window

RenderMode: TypeAlias = Literal["human", "rgb_array"]
RENDER_MODES = list(get_args(RenderMode))
FRAMES_PER_SECOND = 5
"""As fast as the world itself, whose steps take 0.2 s by default."""
PICTURE_SIZE = 640  # px
Picture: TypeAlias = npt.NDArray[np.uint8]


class Spectator:
    """Shows and records the episodes of world 0."""

    def __init__(
        self,
        navigation: Navigation,
        render_mode: RenderMode | None,
        record: str | Path | None,
        layers: Layers | None = None,
    ) -> None:
        """Take a seat.

        Args:
            navigation: The worlds.
            render_mode: ``"human"`` shows each step in a window, ``"rgb_array"`` makes pictures on request.
            record: Folder for a file of each episode, or None.
            layers: What pictures show beside robots and walls.

        Raises:
            InvalidInput: If there is no such mode.
        """
        if render_mode not in {None, *RENDER_MODES}:
            raise InvalidInput(
                f"render_mode: expected one of {', '.join(RENDER_MODES)} or None, got {render_mode!r}"
            )
        self._navigation = navigation
        self._mode = render_mode
        self._layers = Layers() if layers is None else layers
        self._folder = None if record is None else Path(record)
        self._recorder: Recorder | None = None
        self._writer: RecordingWriter | None = None
        self._window: Window | None = None
        self._num_episodes = 0

    def begin(self, seed: int | None) -> None:
        """An episode begins.

        Args:
            seed: What the world was reset with.
        """
        navigation = self._navigation
        world, dt, name = navigation.world, navigation.rules.dt, navigation.scenario.name
        if self._folder is not None:
            self._close_file(is_whole=False)
            self._writer = RecordingWriter(
                self._new_file(self._folder, name), Setting.of(world, 0, dt, name, seed)
            )
            self._writer.write(Moment.of(world, 0))
        if self._mode is not None:
            self._recorder = Recorder(world, 0, dt, name, seed)
            self._show()

    def see(self, step: Step) -> None:
        """A step was made."""
        action, case = step.given[0], step.case[0]
        if self._writer is not None:
            self._writer.write(Moment.of(self._navigation.world, 0, action, case))
        if self._recorder is not None:
            self._recorder.record(action, case)
            self._show()

    def end(self) -> None:
        """The episode is over."""
        self._close_file(is_whole=True)

    def render(self) -> Picture | None:
        """The present moment, shape (height, width, 3), or None if nobody asked for pictures."""
        return self._picture() if self._mode == "rgb_array" else None

    def close(self) -> None:
        """Close window and file; an episode that has not ended is one that was cut."""
        self._close_file(is_whole=False)
        if self._window is not None:
            self._window.close()
            self._window = None

    def _show(self) -> None:
        if self._mode != "human":
            return
        # pygame is needed by those who look only.
        from envs.window import Window  # noqa: PLC0415

        if self._window is None:
            self._window = Window(self._navigation.scenario.name, FRAMES_PER_SECOND)
        picture = self._picture()
        if picture is not None:
            self._window.show(picture)

    def _picture(self) -> Picture | None:
        """The present moment, if an episode has begun."""
        if self._recorder is None:
            return None
        from envs.brush import Canvas  # noqa: PLC0415
        from envs.rendering import draw_moment  # noqa: PLC0415

        recording = self._recorder.recording()
        canvas = Canvas(PICTURE_SIZE, self._navigation.scenario.half_extent)
        last, name = recording.num_moments - 1, recording.setting.scenario
        return draw_moment(recording, last, canvas, name, self._layers)

    def _new_file(self, folder: Path, name: str) -> Path:
        """A file that nobody else has, be it of another run or of another process."""
        folder.mkdir(parents=True, exist_ok=True)
        while True:
            self._num_episodes += 1
            path = folder / f"{_file_name(name)}_{self._num_episodes:05d}{SUFFIX}"
            try:
                path.touch(exist_ok=False)
            except FileExistsError:
                continue
            return path

    def _close_file(self, *, is_whole: bool) -> None:
        if self._writer is not None:
            self._writer.close(is_whole=is_whole)
            self._writer = None


def _file_name(name: str) -> str:
    """A name with nothing in it that a file system could mind."""
    kept = "".join(letter if letter.isalnum() else "_" for letter in name.lower())
    return kept.strip("_") or "episode"

"""Window: pictures on the screen, by pygame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pygame


class Window:
    """Shows one picture after the other, no faster than it is told."""

    def __init__(self, title: str, frames_per_second: float) -> None:
        """Nothing is opened before the first picture.

        Args:
            title: What its bar says.
            frames_per_second: At most.
        """
        self._title = title
        self._rate = frames_per_second
        self._screen: pygame.Surface | None = None

    def show(self, picture: npt.NDArray[np.uint8]) -> None:
        """Show a picture, and wait until it is time for it.

        Args:
            picture: Shape (height, width, 3).
        """
        size = picture.shape[1], picture.shape[0]
        if self._screen is None or self._screen.get_size() != size:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
        pygame.surfarray.blit_array(self._screen, picture.swapaxes(0, 1))
        # Without this the desktop takes the window for one that hangs.
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._rate)

    def close(self) -> None:
        """Close the window."""
        if self._screen is not None:
            pygame.display.quit()
            self._screen = None

"""Brush: what pictures are drawn with, on surfaces of pygame.

m in the world, px in pictures; x points east (right), y north (up).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import pygame
import pygame.freetype

from envs.palette import ALARM, INK, Colour, pale
from safefilter.arrays import FloatArray

Picture: TypeAlias = npt.NDArray[np.uint8]
Place: TypeAlias = tuple[float, float]

# Drawn this much larger, then shrunk: pygame draws hard edges.
SUPERSAMPLING = 2
HEADER, FOOTER = 58, 30  # px
FONT_SIZE = 17  # px


@dataclass(frozen=True, slots=True)
class Canvas:
    """A square window on the world around its origin, with a header for text.

    Attributes:
        size: Width of the picture, in px.
        half_extent: Half the side of the part of the world that is surely seen, in m.
        margin: Seen beyond that, in m: half a robot and its rim.
    """

    size: int
    half_extent: float
    margin: float = 0.2

    @property
    def scale(self) -> float:
        """Resolution of the large picture, in px/m."""
        return SUPERSAMPLING * self.size / (2.0 * (self.half_extent + self.margin))

    def pixels(self, point: FloatArray) -> list[tuple[float, float]]:
        """Places of points in the large picture.

        Args:
            point: Shape (K, 2), in m.
        """
        middle = SUPERSAMPLING * self.size / 2.0
        x = middle + self.scale * point[:, 0]
        y = SUPERSAMPLING * HEADER + middle - self.scale * point[:, 1]
        return list(zip(x.tolist(), y.tolist(), strict=True))


def as_picture(surface: pygame.Surface) -> Picture:
    """What is on a surface, shape (height, width, 3)."""
    return np.ascontiguousarray(pygame.surfarray.array3d(surface).swapaxes(0, 1))


def draw_disc(
    surface: pygame.Surface, place: Place, radius: float, colour: Colour, rim: int
) -> None:
    """A disc with a dark rim, px wide."""
    pygame.draw.circle(surface, INK, place, radius)
    pygame.draw.circle(surface, colour, place, radius - rim)


def draw_wreck(
    surface: pygame.Surface, place: Place, radius: float, colour: Colour, rim: int
) -> None:
    """A pale disc under a red cross."""
    (x, y), arm = place, radius
    pygame.draw.circle(surface, ALARM, place, radius)
    pygame.draw.circle(surface, pale(colour), place, radius - rim)
    for sign in (1.0, -1.0):
        ends = (x - arm, y - sign * arm), (x + arm, y + sign * arm)
        pygame.draw.line(surface, ALARM, *ends, 2 * rim)


def write(
    surface: pygame.Surface,
    place: Place,
    text: str,
    *,
    colour: Colour = INK,
    side: str = "left",
    is_bold: bool = False,
) -> float:
    """Write text that begins, or ends, at a place and is centred on its height; returns where it ends."""
    written, box = _font().render(
        text or " ", colour, style=pygame.freetype.STYLE_STRONG if is_bold else 0
    )
    x = place[0] - box.width if side == "right" else place[0]
    # On one base line, whatever letters there are.
    surface.blit(written, (x, place[1] + 0.36 * FONT_SIZE - box.y))
    return x + box.width


def text_width(text: str) -> float:
    """How wide text is written, in px."""
    return float(_font().get_rect(text).width)


@cache
def _font() -> pygame.freetype.Font:
    pygame.freetype.init()
    return pygame.freetype.Font(None, FONT_SIZE)

"""Legend: what the signs in a picture mean."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pygame

from envs.brush import FOOTER, Picture, Place, as_picture, draw_disc, draw_wreck, text_width, write
from envs.palette import (
    CASE_COLOURS,
    CASE_NAMES,
    INK,
    PAPER,
    PERSON,
    Colour,
    priority_colours,
)
from envs.recording import Recording

Sign = Callable[[pygame.Surface, Place], None]
INDENT, SIGN_WIDTH, GAP = 14.0, 20.0, 14.0  # px
RADIUS = 6.5  # px


def draw_legend(recordings: Sequence[Recording], width: int) -> Picture:
    """Explain the signs that these episodes need, in as many rows as that takes.

    Args:
        recordings: What is shown above it; priorities are the same in all.
        width: Of the picture, in px.

    Returns:
        RGB picture, shape (height, width, 3), the height a multiple of ``FOOTER``.
    """
    rows: list[list[tuple[float, Sign | None, str]]] = [[]]
    x = INDENT
    for sign, text in _entries(recordings):
        needed = text_width(text) + (SIGN_WIDTH if sign else 0.0)
        if rows[-1] and x + needed > width - INDENT:
            rows.append([])
            x = INDENT
        rows[-1].append((x, sign, text))
        x += needed + GAP
    surface = pygame.Surface((width, FOOTER * len(rows)))
    surface.fill(PAPER)
    for number, row in enumerate(rows):
        middle = FOOTER * (number + 0.5)
        for start, sign, text in row:
            if sign is not None:
                sign(surface, (start + RADIUS, middle))
            write(surface, (start + (SIGN_WIDTH if sign else 0.0), middle), text)
    return as_picture(surface)


def _entries(recordings: Sequence[Recording]) -> Iterator[tuple[Sign | None, str]]:
    """Signs and what they mean."""
    setting = recordings[0].setting
    priority = setting.priority[~setting.person]
    levels, first = np.unique(priority, return_index=True)
    colours = priority_colours(priority)
    if len(levels) > 1:
        yield None, "priority"
        for level, robot in zip(levels, first.tolist(), strict=True):
            yield _disc(colours[robot]), f"{level:g}"
    yield _goal, "goal"
    yield _wreck, "collided"
    if setting.person.any():
        yield _disc(PERSON), "person"
    for case, name in CASE_NAMES.items():
        if any((recording.case == case).any() for recording in recordings):
            yield _ring(CASE_COLOURS[case]), name


def _disc(colour: Colour) -> Sign:
    def draw(surface: pygame.Surface, place: Place) -> None:
        draw_disc(surface, place, RADIUS, colour, 1)

    return draw


def _ring(colour: Colour) -> Sign:
    def draw(surface: pygame.Surface, place: Place) -> None:
        pygame.draw.circle(surface, colour, place, RADIUS, 3)

    return draw


def _wreck(surface: pygame.Surface, place: Place) -> None:
    draw_wreck(surface, place, RADIUS, PAPER, 1)


def _goal(surface: pygame.Surface, place: Place) -> None:
    pygame.draw.circle(surface, INK, place, RADIUS, 1)
    pygame.draw.circle(surface, INK, place, 1.8)

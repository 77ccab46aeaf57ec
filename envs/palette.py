"""Palette: what colour stands for what.

Letters: N robots.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from envs.recording import Recording
from safefilter.arrays import FloatArray
from safefilter.decision import Case

Colour: TypeAlias = tuple[int, int, int]

PAPER: Colour = (255, 255, 255)
INK: Colour = (35, 39, 47)
FAINT: Colour = (226, 229, 234)
WALL: Colour = (90, 96, 106)
ALARM: Colour = (214, 30, 30)
BEAM: Colour = (242, 196, 160)
AREA: Colour = (236, 243, 226)
PERSON: Colour = (150, 140, 125)
# From low to high priority; told apart by lightness too, so that colour-blind readers see the order.
PRIORITY_COLOURS: tuple[Colour, ...] = (
    (125, 190, 235),
    (60, 125, 200),
    (110, 60, 165),
    (60, 15, 75),
)
CASE_COLOURS: dict[int, Colour] = {
    Case.PROJECTED: (245, 160, 0),
    Case.LEAST_VIOLATION: (205, 0, 120),
}
"""Of rings around robots whose action a filter changed."""
CASE_NAMES: dict[int, str] = {
    Case.PROJECTED: "corrected",
    Case.LEAST_VIOLATION: "nothing permitted",
}


def robot_colours(recording: Recording) -> list[Colour]:
    """Colour of each robot: by its priority; of people grey."""
    setting = recording.setting
    colours = iter(priority_colours(setting.priority[~setting.person]))
    return [PERSON if is_person else next(colours) for is_person in setting.person.tolist()]


def priority_colours(priority: FloatArray) -> list[Colour]:
    """Colour of each robot, by the logarithm of its priority; all the same where priorities are.

    Args:
        priority: Shape (N,), positive.
    """
    if not len(priority):
        return []
    level = np.log(priority)
    spread = float(level.max() - level.min())
    share = (level - level.min()) / spread if spread > 0.0 else np.full(len(priority), 0.4)
    stops = np.array(PRIORITY_COLOURS, dtype=np.float64)
    place = share * (len(stops) - 1)
    channels = [np.interp(place, np.arange(len(stops)), stops[:, c]) for c in range(3)]
    return [
        (round(red), round(green), round(blue)) for red, green, blue in zip(*channels, strict=True)
    ]


def contrast(colour: Colour) -> Colour:
    """What is seen on a colour."""
    return PAPER if sum(colour) < 384 else INK


def pale(colour: Colour) -> Colour:
    """The same colour, half way to white."""
    red, green, blue = ((channel + 255) // 2 for channel in colour)
    return red, green, blue

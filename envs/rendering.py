"""Pictures of a recording: one moment from above, or several side by side.

Letters: T moments, N robots, S walls. m in the world, px in pictures; x points east (right), y north (up).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envs.recording import Recording
from safefilter.arrays import FloatArray

Colour: TypeAlias = tuple[int, int, int]

PAPER: Colour = (255, 255, 255)
INK: Colour = (35, 39, 47)
FAINT: Colour = (226, 229, 234)
WALL: Colour = (90, 96, 106)
ALARM: Colour = (214, 30, 30)
# From low to high priority; told apart by lightness too, so that colour-blind readers see the order.
PRIORITY_COLOURS: tuple[Colour, ...] = (
    (125, 190, 235),
    (60, 125, 200),
    (110, 60, 165),
    (60, 15, 75),
)

# Drawn this much larger, then shrunk: Pillow draws hard edges.
SUPERSAMPLING = 2
HEADER, FOOTER = 58, 30  # px
FONT_SIZE = 16  # px


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


def draw_moment(recording: Recording, moment: int, canvas: Canvas, title: str = "") -> Image.Image:
    """Draw one moment: walls, goals as rings, trails, robots coloured by priority, a red cross on those that collided.

    Robots that face a direction have a line from the centre to the rim.

    Args:
        recording: Episode.
        moment: Which moment of it.
        canvas: Window.
        title: First words of the header.

    Returns:
        RGB picture of ``canvas.size`` by ``HEADER + canvas.size`` px.
    """
    size = (SUPERSAMPLING * canvas.size, SUPERSAMPLING * (HEADER + canvas.size))
    picture = Image.new("RGB", size, PAPER)
    draw = ImageDraw.Draw(picture)
    colours = priority_colours(recording.priority)
    _draw_grid(draw, canvas)
    _draw_walls(draw, canvas, recording.walls)
    _draw_goals(draw, canvas, recording, colours)
    _draw_trails(draw, canvas, recording, moment, colours)
    _draw_robots(draw, canvas, recording, moment, colours)
    _draw_header(draw, canvas, recording, moment, title)
    return picture.resize((canvas.size, HEADER + canvas.size), Image.Resampling.BOX)


def side_by_side(
    recordings: Sequence[tuple[str, Recording]], moment: int, canvas: Canvas
) -> Image.Image:
    """Draw the same moment of several episodes; one that has ended shows its last moment.

    Args:
        recordings: Titles and episodes; priorities are the same in all.
        moment: Which moment.
        canvas: Window of each picture.

    Returns:
        RGB picture with a legend of the colours at the bottom.
    """
    width = canvas.size * len(recordings)
    picture = Image.new("RGB", (width, HEADER + canvas.size + FOOTER), PAPER)
    for place, (title, recording) in enumerate(recordings):
        part = draw_moment(recording, min(moment, recording.num_moments - 1), canvas, title)
        picture.paste(part, (place * canvas.size, 0))
    draw = ImageDraw.Draw(picture)
    for place in range(1, len(recordings)):
        draw.line([(place * canvas.size, 8), (place * canvas.size, HEADER + canvas.size)], FAINT, 2)
    _draw_legend(draw, recordings[0][1].priority, HEADER + canvas.size)
    return picture


def priority_colours(priority: FloatArray) -> list[Colour]:
    """Colour of each robot, by the logarithm of its priority; all the same where priorities are.

    Args:
        priority: Shape (N,), positive.
    """
    level = np.log(priority)
    spread = float(level.max() - level.min())
    share = (level - level.min()) / spread if spread > 0.0 else np.full(len(priority), 0.4)
    stops = np.array(PRIORITY_COLOURS, dtype=np.float64)
    place = share * (len(stops) - 1)
    channels = [np.interp(place, np.arange(len(stops)), stops[:, c]) for c in range(3)]
    return [
        (round(red), round(green), round(blue)) for red, green, blue in zip(*channels, strict=True)
    ]


def _draw_grid(draw: ImageDraw.ImageDraw, canvas: Canvas) -> None:
    half = canvas.half_extent + canvas.margin
    for line in range(-math.floor(half), math.floor(half) + 1):
        ends = np.array([[line, -half], [line, half]])
        draw.line(canvas.pixels(ends), FAINT, SUPERSAMPLING)
        draw.line(canvas.pixels(ends[:, ::-1]), FAINT, SUPERSAMPLING)


def _draw_walls(draw: ImageDraw.ImageDraw, canvas: Canvas, walls: FloatArray) -> None:
    width = 3 * SUPERSAMPLING
    for wall in walls:
        ends = canvas.pixels(wall)
        draw.line(ends, WALL, width)
        # Round ends close the corners.
        for end in ends:
            draw.circle(end, 0.5 * width, WALL)


def _draw_goals(
    draw: ImageDraw.ImageDraw, canvas: Canvas, recording: Recording, colours: Sequence[Colour]
) -> None:
    for place, radius, colour in zip(
        canvas.pixels(recording.goal), recording.radius, colours, strict=True
    ):
        draw.circle(place, radius * canvas.scale, PAPER, colour, SUPERSAMPLING)
        draw.circle(place, 0.25 * radius * canvas.scale, colour)


def _draw_trails(
    draw: ImageDraw.ImageDraw,
    canvas: Canvas,
    recording: Recording,
    moment: int,
    colours: Sequence[Colour],
) -> None:
    if moment == 0:
        return
    for robot, colour in enumerate(colours):
        trail = canvas.pixels(recording.position[: moment + 1, robot])
        draw.line(trail, _pale(colour), 2 * SUPERSAMPLING)


def _draw_robots(
    draw: ImageDraw.ImageDraw,
    canvas: Canvas,
    recording: Recording,
    moment: int,
    colours: Sequence[Colour],
) -> None:
    places = canvas.pixels(recording.position[moment])
    for robot in np.flatnonzero(recording.present[moment]).tolist():
        radius = recording.radius[robot] * canvas.scale
        if recording.collided[moment, robot]:
            _draw_wreck(draw, places[robot], radius, colours[robot])
        else:
            draw.circle(places[robot], radius, colours[robot], INK, SUPERSAMPLING)
        if recording.has_heading:
            x, y = places[robot]
            heading = recording.heading[moment, robot]
            nose = x + radius * math.cos(heading), y - radius * math.sin(heading)
            draw.line([(x, y), nose], _contrast(colours[robot]), 2 * SUPERSAMPLING)


def _contrast(colour: Colour) -> Colour:
    return PAPER if sum(colour) < 384 else INK


def _draw_wreck(
    draw: ImageDraw.ImageDraw, place: tuple[float, float], radius: float, colour: Colour
) -> None:
    (x, y), arm = place, radius
    draw.circle(place, radius, _pale(colour), ALARM, SUPERSAMPLING)
    for sign in (1.0, -1.0):
        ends = [(x - arm, y - sign * arm), (x + arm, y + sign * arm)]
        draw.line(ends, ALARM, 2 * SUPERSAMPLING)


def _draw_header(
    draw: ImageDraw.ImageDraw, canvas: Canvas, recording: Recording, moment: int, title: str
) -> None:
    collided = int(recording.collided[moment].sum())
    arrived = int((recording.arrived[moment] & ~recording.collided[moment]).sum())
    left, right = SUPERSAMPLING * 14, SUPERSAMPLING * (canvas.size - 14)
    first, second = SUPERSAMPLING * 8, SUPERSAMPLING * 32
    font = _font(SUPERSAMPLING * FONT_SIZE)
    draw.text((left, first), title, INK, font, stroke_width=1)
    draw.text((right, first), f"{recording.time[moment]:.1f} s", INK, font, anchor="ra")
    draw.text((left, second), f"arrived {arrived} of {recording.num_robots}", INK, font)
    colour = ALARM if collided else INK
    draw.text((right, second), f"collided {collided}", colour, font, anchor="ra")


def _draw_legend(draw: ImageDraw.ImageDraw, priority: FloatArray, top: int) -> None:
    font = _font(FONT_SIZE - 2)
    x, middle = 14.0, top + FOOTER / 2.0
    levels, first = np.unique(priority, return_index=True)
    colours = priority_colours(priority)
    draw.text((x, middle), "priority", INK, font, anchor="lm")
    x += draw.textlength("priority", font) + 14.0
    for level, robot in zip(levels, first.tolist(), strict=True):
        draw.circle((x + 6.0, middle), 6.0, colours[robot], INK)
        text = f"{level:g}"
        draw.text((x + 18.0, middle), text, INK, font, anchor="lm")
        x += 18.0 + draw.textlength(text, font) + 16.0
    draw.circle((x + 14.0, middle), 6.0, PAPER, INK)
    draw.circle((x + 14.0, middle), 1.5, INK)
    draw.text((x + 26.0, middle), "goal", INK, font, anchor="lm")
    x += 26.0 + draw.textlength("goal", font) + 24.0
    _draw_wreck(draw, (x, middle), 6.0, PAPER)
    draw.text((x + 14.0, middle), "collided", INK, font, anchor="lm")


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _pale(colour: Colour) -> Colour:
    red, green, blue = ((channel + 255) // 2 for channel in colour)
    return red, green, blue

"""Pictures of a recording: one moment from above, or several side by side.

Letters: T moments, N robots, S walls, K beams. m in the world, px in pictures; x points east (right), y north (up).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pygame

from envs.brush import (
    HEADER,
    SUPERSAMPLING,
    Canvas,
    Picture,
    as_picture,
    draw_disc,
    draw_wreck,
    write,
)
from envs.layers import Layers
from envs.legend import draw_legend
from envs.norm_area import NormArea
from envs.palette import (
    ALARM,
    AREA,
    BEAM,
    CASE_COLOURS,
    FAINT,
    INK,
    PAPER,
    WALL,
    Colour,
    contrast,
    pale,
    robot_colours,
)
from envs.recorded_lidar import beam_ends
from envs.recording import Recording
from safefilter.arrays import FloatArray

NO_LAYERS = Layers()


def draw_moment(
    recording: Recording,
    moment: int,
    canvas: Canvas,
    title: str = "",
    layers: Layers = NO_LAYERS,
) -> Picture:
    """Draw one moment: walls, goals as rings, trails, robots coloured by priority, a red cross on those that collided.

    Robots that face a direction have a line from the centre to the rim; those whose action a filter changed have a
    ring around them. People are grey.

    Args:
        recording: Episode.
        moment: Which moment of it.
        canvas: Window.
        title: First words of the header.
        layers: What else to draw.

    Returns:
        RGB picture, shape (HEADER + canvas.size, canvas.size, 3).
    """
    large = pygame.Surface((SUPERSAMPLING * canvas.size, SUPERSAMPLING * (HEADER + canvas.size)))
    large.fill(PAPER)
    colours = robot_colours(recording)
    _draw_grid(large, canvas)
    if layers.has_areas:
        _draw_areas(large, canvas, recording, moment)
    if layers.num_beams:
        _draw_beams(large, canvas, recording, moment, layers)
    _draw_walls(large, canvas, recording.setting.walls)
    _draw_goals(large, canvas, recording, colours)
    _draw_trails(large, canvas, recording, moment, colours)
    _draw_robots(large, canvas, recording, moment, colours)
    picture = pygame.transform.smoothscale(large, (canvas.size, HEADER + canvas.size))
    _draw_header(picture, canvas, recording, moment, title)
    return as_picture(picture)


def side_by_side(
    recordings: Sequence[tuple[str, Recording]],
    moment: int,
    canvas: Canvas,
    layers: Layers = NO_LAYERS,
) -> Picture:
    """Draw the same moment of several episodes; one that has ended shows its last moment.

    Args:
        recordings: Titles and episodes; priorities are the same in all.
        moment: Which moment.
        canvas: Window of each picture.
        layers: What else to draw.

    Returns:
        RGB picture with a legend of the colours at the bottom, shape (height, width, 3).
    """
    parts = [
        draw_moment(recording, min(moment, recording.num_moments - 1), canvas, title, layers)
        for title, recording in recordings
    ]
    for part in parts[1:]:
        part[8:, :2] = FAINT
    row = np.concatenate(parts, axis=1)
    legend = draw_legend([recording for _, recording in recordings], row.shape[1])
    return np.concatenate([row, legend], axis=0)


def _draw_grid(surface: pygame.Surface, canvas: Canvas) -> None:
    half = canvas.half_extent + canvas.margin
    # Fewer lines in a wide world.
    every = max(1, round(half / 8.0))
    last = math.floor(half / every) * every
    for line in range(-last, last + 1, every):
        ends = np.array([[line, -half], [line, half]])
        for way in (ends, ends[:, ::-1]):
            start, end = canvas.pixels(way)
            pygame.draw.line(surface, FAINT, start, end, SUPERSAMPLING)


def _draw_areas(surface: pygame.Surface, canvas: Canvas, recording: Recording, moment: int) -> None:
    facing = _facing(recording, moment)
    shown = (
        recording.present[moment] & ~recording.setting.person & (np.abs(facing).sum(axis=1) > 0.0)
    )
    area = NormArea.of_paper()
    for corners in area.placed(recording.position[moment][shown], facing[shown]):
        pygame.draw.polygon(surface, AREA, canvas.pixels(corners))
        pygame.draw.polygon(surface, pale(WALL), canvas.pixels(corners), SUPERSAMPLING)


def _facing(recording: Recording, moment: int) -> FloatArray:
    """Unit vectors forward, shape (N, 2): headings, or courses of robots that have none; zero at rest."""
    if recording.setting.has_heading:
        heading = recording.heading[moment]
        return np.stack([np.cos(heading), np.sin(heading)], axis=1)
    way = recording.position[moment] - recording.position[max(0, moment - 1)]
    length = np.hypot(way[:, 0], way[:, 1])[:, np.newaxis]
    return np.asarray(np.divide(way, length, out=np.zeros_like(way), where=length > 0.0))


def _draw_beams(
    surface: pygame.Surface, canvas: Canvas, recording: Recording, moment: int, layers: Layers
) -> None:
    starts, ends = beam_ends(recording, moment, layers.num_beams, layers.lidar_range)
    for start, end in zip(canvas.pixels(starts), canvas.pixels(ends), strict=True):
        pygame.draw.line(surface, BEAM, start, end)


def _draw_walls(surface: pygame.Surface, canvas: Canvas, walls: FloatArray) -> None:
    width = 3 * SUPERSAMPLING
    for wall in walls:
        ends = canvas.pixels(wall)
        pygame.draw.line(surface, WALL, ends[0], ends[1], width)
        # Round ends close the corners.
        for end in ends:
            pygame.draw.circle(surface, WALL, end, 0.5 * width)


def _draw_goals(
    surface: pygame.Surface, canvas: Canvas, recording: Recording, colours: Sequence[Colour]
) -> None:
    setting = recording.setting
    for robot, place in enumerate(canvas.pixels(setting.goal)):
        if setting.person[robot]:
            continue
        radius = setting.radius[robot] * canvas.scale
        pygame.draw.circle(surface, colours[robot], place, radius, SUPERSAMPLING)
        pygame.draw.circle(surface, colours[robot], place, 0.25 * radius)


def _draw_trails(
    surface: pygame.Surface,
    canvas: Canvas,
    recording: Recording,
    moment: int,
    colours: Sequence[Colour],
) -> None:
    if moment == 0:
        return
    for robot, colour in enumerate(colours):
        for trail in _unbroken(recording.position[: moment + 1, robot]):
            pygame.draw.lines(surface, pale(colour), False, canvas.pixels(trail), 2 * SUPERSAMPLING)


def _unbroken(way: FloatArray) -> list[FloatArray]:
    """Parts of a way between jumps, which are those of robots that are reborn."""
    step = np.hypot(*np.diff(way, axis=0).T)
    jumps = np.flatnonzero(step > max(10.0 * float(np.median(step)), 0.5)) + 1
    return [part for part in np.split(way, jumps) if len(part) > 1]


def _draw_robots(
    surface: pygame.Surface,
    canvas: Canvas,
    recording: Recording,
    moment: int,
    colours: Sequence[Colour],
) -> None:
    places = canvas.pixels(recording.position[moment])
    for robot in np.flatnonzero(recording.present[moment]).tolist():
        place, radius = places[robot], recording.setting.radius[robot] * canvas.scale
        colour = colours[robot]
        if recording.collided[moment, robot]:
            draw_wreck(surface, place, radius, colour, SUPERSAMPLING)
        else:
            draw_disc(surface, place, radius, colour, SUPERSAMPLING)
        case = int(recording.case[moment, robot])
        if case in CASE_COLOURS:
            rim = 2.5 * SUPERSAMPLING
            pygame.draw.circle(surface, CASE_COLOURS[case], place, radius + 1.6 * rim, round(rim))
        if recording.setting.has_heading or recording.setting.person[robot]:
            heading = recording.heading[moment, robot]
            nose = place[0] + radius * math.cos(heading), place[1] - radius * math.sin(heading)
            pygame.draw.line(surface, contrast(colour), place, nose, 2 * SUPERSAMPLING)


def _draw_header(
    surface: pygame.Surface, canvas: Canvas, recording: Recording, moment: int, title: str
) -> None:
    robots = ~recording.setting.person
    is_wreck = recording.collided[moment] & robots
    collided = int(is_wreck.sum())
    arrived = int((recording.arrived[moment] & robots & ~is_wreck).sum())
    left, right = 14, canvas.size - 14
    write(surface, (left, 18), title, is_bold=True)
    write(surface, (right, 18), f"{recording.time[moment]:.1f} s", side="right")
    write(surface, (left, 42), f"arrived {arrived} of {int(robots.sum())}")
    colour = ALARM if collided else INK
    write(surface, (right, 42), f"collided {collided}", colour=colour, side="right")

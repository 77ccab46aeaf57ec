"""Random crowds by the thousand, for runs too long for Hypothesis: many worlds in one scene.

Robots are put down one after the other, each beside one that stands already: exactly touching it, a micrometre off, or
further away. No two overlap.

Letters: W worlds, N robots of all worlds, d dimensions: 2, or 3 in space. m, m/s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.scene import Scene
from safefilter.scene_arrays import PLANE

MIN_ROBOTS, MAX_ROBOTS = 2, 50
RADII = (0.05, 0.5)
SPEEDS = (0.1, 2.0)
# Priorities of 1e-3 to 1e3: ratios up to 1e6.
PRIORITY_DECADES = 3.0
PASSIVE_SHARE = 0.15
# Free distance to the robot beside which another is put down, in m; beyond a
# micrometre it is the largest, and each robot draws its own.
TIGHTNESS = (0.0, 1e-6, 0.5, 4.0)
ATTEMPTS = 20
# How far robots see, in m: more than any can cover within the time horizon of two seconds at half speed.
SIGHT = 6.0


class Crowd(NamedTuple):
    """Robots of many worlds.

    Attributes:
        scene: The robots; some do not cooperate.
        v_max: Top speeds, shape (N,), in m/s.
    """

    scene: Scene
    v_max: FloatArray


def random_crowd(
    rng: np.random.Generator,
    num_robots: int,
    *,
    most_robots: int = MAX_ROBOTS,
    dimension: int = PLANE,
) -> Crowd:
    """Draw worlds until they hold at least ``num_robots``.

    Args:
        rng: Source of chance.
        num_robots: Robots of all worlds together, at least.
        most_robots: In one world, at most; `MIN_ROBOTS` at least.
        dimension: Of the worlds.
    """
    sizes: list[int] = []
    while sum(sizes) < num_robots:
        sizes.append(int(_log_uniform(rng, (MIN_ROBOTS, most_robots + 1), 1)[0]))
    size = np.array(sizes)
    world = np.repeat(np.arange(len(size)), size)
    total = len(world)
    radius = _log_uniform(rng, RADII, total)
    # Slow worlds and fast ones, and in each robots of half the speed of others.
    fastest = _log_uniform(rng, SPEEDS, len(size))
    v_max = fastest[world] * rng.uniform(0.5, 1.0, total)
    direction = _directions(rng, total, dimension)
    speed = v_max * rng.uniform(0.0, 1.0, total)
    cooperative = rng.uniform(size=total) >= PASSIVE_SHARE
    # Someone has to be filtered.
    cooperative[np.cumsum(size) - size] = True
    scene = Scene.from_world(
        put_down(rng, size, radius, dimension),
        speed[:, None] * direction,
        radius,
        priority=10.0 ** rng.uniform(-PRIORITY_DECADES, PRIORITY_DECADES, total),
        cooperative=cooperative,
        world=world,
        reach=SIGHT,
    )
    return Crowd(scene, v_max)


def put_down(
    rng: np.random.Generator, size: IntArray, radius: FloatArray, dimension: int = PLANE
) -> FloatArray:
    """Find places without overlap.

    Args:
        rng: Source of chance.
        size: Number of robots of each world, shape (W,).
        radius: Radii, world after world, shape (N,), in m.
        dimension: Number d of coordinates.

    Returns:
        Centres, shape (N, d), in m.
    """
    num_worlds, largest = len(size), int(size.max())
    present = np.arange(largest) < size[:, None]
    radii = np.zeros((num_worlds, largest))
    radii[present] = radius
    place = np.zeros((num_worlds, largest, dimension))
    gap = rng.choice(TIGHTNESS, num_worlds)
    for k in range(1, largest):
        waiting = present[:, k].copy()
        for attempt in range(ATTEMPTS):
            at = np.flatnonzero(waiting)
            if len(at) == 0:
                break
            tried = _beside(rng, place[at, :k], radii[at, : k + 1], gap[at], attempt)
            place[at, k] = tried
            waiting[at] = ~_is_free(tried, place[at, :k], radii[at, : k + 1])
    return place[present]


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float], size: int) -> FloatArray:
    low, high = limits
    return np.asarray(low * (high / low) ** rng.uniform(size=size))


def _beside(
    rng: np.random.Generator, place: FloatArray, radii: FloatArray, gap: FloatArray, attempt: int
) -> FloatArray:
    """Propose a place for one robot a world, shape (W, d); the last attempt is far away from everyone."""
    num_worlds, placed, dimension = place.shape
    worlds = np.arange(num_worlds)
    anchor = np.asarray(rng.integers(0, placed, num_worlds))
    # Beyond a micrometre every robot has a gap of its own.
    free = np.where(gap > 1e-3, gap * rng.uniform(size=num_worlds), gap)
    reach = radii[worlds, anchor] + radii[:, placed] + free
    if attempt == ATTEMPTS - 1:
        anchor = np.zeros(num_worlds, dtype=np.int64)
        reach = np.hypot.reduce(place, axis=2).max(axis=1) + 2.0 * radii.max(axis=1)
    step = reach[:, None] * _directions(rng, num_worlds, dimension)
    centre: FloatArray = place[worlds, anchor] + step
    return centre


def _directions(rng: np.random.Generator, size: int, dimension: int) -> FloatArray:
    """Unit vectors, each as likely as any other, shape (size, d)."""
    if dimension > PLANE:
        drawn = rng.normal(size=(size, dimension))
        return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))
    angle = rng.uniform(0.0, 2.0 * np.pi, size)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _is_free(tried: FloatArray, place: FloatArray, radii: FloatArray) -> BoolArray:
    """Is a place free? Touching is, up to rounding."""
    offset = place - tried[:, None]
    gap = np.hypot.reduce(offset, axis=2) - radii[:, :-1] - radii[:, -1:]
    return np.asarray(gap.min(axis=1) >= -1e-14)

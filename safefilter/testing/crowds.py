"""Random crowds by the thousand, for runs too long for Hypothesis: many worlds in one scene.

Robots are put down one after the other, each beside one that stands already: exactly touching it, a micrometre off, or
further away. No two overlap.

Letters: W worlds, N robots of all worlds. m, m/s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.scene import Scene

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


def random_crowd(rng: np.random.Generator, num_robots: int) -> Crowd:
    """Draw worlds of `MIN_ROBOTS` to `MAX_ROBOTS` robots until they hold at least ``num_robots``."""
    sizes: list[int] = []
    while sum(sizes) < num_robots:
        sizes.append(int(_log_uniform(rng, (MIN_ROBOTS, MAX_ROBOTS + 1), 1)[0]))
    size = np.array(sizes)
    world = np.repeat(np.arange(len(size)), size)
    total = len(world)
    radius = _log_uniform(rng, RADII, total)
    # Slow worlds and fast ones, and in each robots of half the speed of others.
    fastest = _log_uniform(rng, SPEEDS, len(size))
    v_max = fastest[world] * rng.uniform(0.5, 1.0, total)
    angle = rng.uniform(0.0, 2.0 * np.pi, total)
    speed = v_max * rng.uniform(0.0, 1.0, total)
    cooperative = rng.uniform(size=total) >= PASSIVE_SHARE
    # Someone has to be filtered.
    cooperative[np.cumsum(size) - size] = True
    scene = Scene.from_world(
        put_down(rng, size, radius),
        np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=1),
        radius,
        priority=10.0 ** rng.uniform(-PRIORITY_DECADES, PRIORITY_DECADES, total),
        cooperative=cooperative,
        world=world,
        reach=SIGHT,
    )
    return Crowd(scene, v_max)


def put_down(rng: np.random.Generator, size: IntArray, radius: FloatArray) -> FloatArray:
    """Find places without overlap.

    Args:
        rng: Source of chance.
        size: Number of robots of each world, shape (W,).
        radius: Radii, world after world, shape (N,), in m.

    Returns:
        Centres, shape (N, 2), in m.
    """
    num_worlds, largest = len(size), int(size.max())
    present = np.arange(largest) < size[:, None]
    radii = np.zeros((num_worlds, largest))
    radii[present] = radius
    place = np.zeros((num_worlds, largest, 2))
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
    """Propose a place for one robot a world, shape (W, 2); the last attempt is far away from everyone."""
    num_worlds, placed = place.shape[:2]
    worlds = np.arange(num_worlds)
    anchor = np.asarray(rng.integers(0, placed, num_worlds))
    # Beyond a micrometre every robot has a gap of its own.
    free = np.where(gap > 1e-3, gap * rng.uniform(size=num_worlds), gap)
    reach = radii[worlds, anchor] + radii[:, placed] + free
    if attempt == ATTEMPTS - 1:
        anchor = np.zeros(num_worlds, dtype=np.int64)
        reach = np.hypot(*np.moveaxis(place, 2, 0)).max(axis=1) + 2.0 * radii.max(axis=1)
    angle = rng.uniform(0.0, 2.0 * np.pi, num_worlds)
    step = np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1)
    centre: FloatArray = place[worlds, anchor] + step
    return centre


def _is_free(tried: FloatArray, place: FloatArray, radii: FloatArray) -> BoolArray:
    """Is a place free? Touching is, up to rounding."""
    offset = place - tried[:, None]
    gap = np.hypot(offset[:, :, 0], offset[:, :, 1]) - radii[:, :-1] - radii[:, -1:]
    return np.asarray(gap.min(axis=1) >= -1e-14)

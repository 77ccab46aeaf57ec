"""Hypothesis strategies for robots in space; like `strategies`, whose `rollouts` takes these scenes as well.

Needs the extra ``testing``.

Letters: N robots. m, m/s.
"""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from safefilter.scene import Scene
from safefilter.testing.strategies import (
    GAPS,
    MAX_ROBOTS,
    MAX_SPEED,
    angles,
    priorities,
    pushed_free,
    radii,
)

Vector = tuple[float, float, float]


@st.composite
def directions(draw: st.DrawFn) -> Vector:
    """Unit vectors, those of the axes and of the plane of the first two coordinates among them."""
    angle = draw(angles())
    rise = draw(st.sampled_from((0.0, 1.0, -1.0, 0.5)) | st.floats(-1.0, 1.0))
    flat = math.sqrt(1.0 - rise * rise)
    return flat * math.cos(angle), flat * math.sin(angle), rise


@st.composite
def velocities_in_space(draw: st.DrawFn, top_speed: float = MAX_SPEED) -> Vector:
    """Velocities up to a speed, standing still and full speed among them."""
    speed = top_speed * draw(st.integers(0, 4).map(lambda k: k / 4) | st.floats(0.0, 1.0))
    x, y, z = draw(directions())
    return speed * x, speed * y, speed * z


@st.composite
def scenes_in_space(
    draw: st.DrawFn,
    num_robots: st.SearchStrategy[int] | None = None,
    gaps: st.SearchStrategy[float] | None = None,
    *,
    cooperative: st.SearchStrategy[bool] | None = None,
) -> Scene:
    """Robots anywhere in space, with wanted velocities; robot 0 cooperates.

    Args:
        draw: Given by Hypothesis.
        num_robots: Their number; 2 to `MAX_ROBOTS` if None.
        gaps: Free distance in m to the robot beside which another is put down; those of `GAPS` if None.
        cooperative: Whether another robot cooperates; mostly if None.
    """
    size = draw(st.integers(2, MAX_ROBOTS) if num_robots is None else num_robots)
    gaps = st.sampled_from(GAPS) if gaps is None else gaps
    cooperative = st.sampled_from((True, True, True, False)) if cooperative is None else cooperative
    radius = [draw(radii()) for _ in range(size)]
    place: list[tuple[float, ...]] = [(0.0, 0.0, 0.0)]
    for k in range(1, size):
        anchor = place[draw(st.integers(0, k - 1))]
        place.append(pushed_free(anchor, draw(directions()), draw(gaps), place, radius))
    return Scene.from_world(
        place,
        [draw(velocities_in_space()) for _ in range(size)],
        radius,
        priority=[draw(priorities()) for _ in range(size)],
        cooperative=[True, *(draw(cooperative) for _ in range(size - 1))],
        wanted=[draw(velocities_in_space()) for _ in range(size)],
    )


def crowded_in_space() -> st.SearchStrategy[Scene]:
    """Four to ten robots within a step's reach of each other."""
    return scenes_in_space(st.integers(4, 10), st.sampled_from((0.05, 1e-3, 1e-6, 0.0)))


def touching_in_space() -> st.SearchStrategy[Scene]:
    """Two to six robots, each in contact with another: a gap of exactly 0 up to rounding."""
    return scenes_in_space(st.integers(2, 6), st.just(0.0))


def lifted(scene: Scene, height: float = 0.0) -> Scene:
    """Put a scene of the plane into space, all robots at one height in m and moving level."""
    level, flat = np.full((scene.num_robots, 1), height), np.zeros((scene.num_robots, 1))
    return Scene.from_world(
        np.hstack([scene.position, level]),
        np.hstack([scene.velocity, flat]),
        scene.radius,
        priority=scene.priority,
        cooperative=scene.cooperative,
        wanted=None if scene.wanted is None else np.hstack([scene.wanted, flat]),
        world=scene.world,
        reach=scene.reach if np.isfinite(scene.reach) else None,
    )

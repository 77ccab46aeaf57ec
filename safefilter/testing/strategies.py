"""Hypothesis strategies for robots and what drives them, named by what is drawn; they shrink to few, round numbers.

Robots never overlap at the start: each is put down beside one that stands already, and pushed on until it is free.
Needs the extra ``testing``.

Letters: N robots. m, m/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.scene import Scene
from safefilter.testing.policies import (
    GoalSeeking,
    Mixed,
    NotFinite,
    Policy,
    Ramming,
    UniformRandom,
)
from safefilter.testing.rollout import Trial

# Free distances at the start: exactly touching, a micrometre, within the reach of a step, and beyond.
GAPS = (1.0, 0.3, 0.05, 1e-3, 1e-6, 0.0)
MAX_RADIUS = 0.5
MAX_SPEED = 2.0
MAX_ROBOTS = 6
MAX_STEPS = 12


def radii() -> st.SearchStrategy[float]:
    """Radii from 0.05 to 0.5 m."""
    return st.integers(1, 10).map(lambda k: k / 20) | st.floats(0.05, MAX_RADIUS)


def speeds() -> st.SearchStrategy[float]:
    """Top speeds from 0.1 to 2 m/s."""
    return st.integers(1, 20).map(lambda k: k / 10) | st.floats(0.1, MAX_SPEED)


def priorities() -> st.SearchStrategy[float]:
    """Priorities from 1e-3 to 1e3: any two are in a ratio of at most a million."""
    return st.sampled_from((1.0, 2.0, 10.0, 1e-3, 1e3)) | st.floats(1e-3, 1e3)


def angles() -> st.SearchStrategy[float]:
    """Directions in rad, multiples of 15 degrees as well as any."""
    return st.integers(0, 23).map(lambda k: k * math.pi / 12) | st.floats(0.0, 6.28)


@st.composite
def velocities(draw: st.DrawFn, top_speed: float = MAX_SPEED) -> tuple[float, float]:
    """Velocities up to a speed, standing still and full speed among them."""
    speed, angle = (
        draw(st.integers(0, 4).map(lambda k: k / 4) | st.floats(0.0, 1.0)),
        draw(angles()),
    )
    return top_speed * speed * math.cos(angle), top_speed * speed * math.sin(angle)


@st.composite
def scenes(
    draw: st.DrawFn,
    num_robots: st.SearchStrategy[int] | None = None,
    gaps: st.SearchStrategy[float] | None = None,
    *,
    cooperative: st.SearchStrategy[bool] | None = None,
) -> Scene:
    """Robots anywhere, with wanted velocities; robot 0 cooperates.

    Args:
        draw: Given by Hypothesis.
        num_robots: Their number; 2 to `MAX_ROBOTS` if None.
        gaps: Free distance in m to the robot beside which another is put down; those of `GAPS` if None.
        cooperative: Whether another robot cooperates; mostly if None.
    """
    size = draw(st.integers(2, MAX_ROBOTS) if num_robots is None else num_robots)
    gaps = st.sampled_from(GAPS) if gaps is None else gaps
    # Hypothesis prefers the first: most robots cooperate.
    cooperative = st.sampled_from((True, True, True, False)) if cooperative is None else cooperative
    radius = [draw(radii()) for _ in range(size)]
    place: list[tuple[float, ...]] = [(0.0, 0.0)]
    for k in range(1, size):
        anchor = place[draw(st.integers(0, k - 1))]
        angle = draw(angles())
        direction = math.cos(angle), math.sin(angle)
        place.append(pushed_free(anchor, direction, draw(gaps), place, radius))
    return Scene.from_world(
        place,
        [draw(velocities()) for _ in range(size)],
        radius,
        priority=[draw(priorities()) for _ in range(size)],
        cooperative=[True, *(draw(cooperative) for _ in range(size - 1))],
        wanted=[draw(velocities()) for _ in range(size)],
    )


def crowded() -> st.SearchStrategy[Scene]:
    """Four to eight robots within a step's reach of each other."""
    return scenes(st.integers(4, 8), st.sampled_from((0.05, 1e-3, 1e-6, 0.0)))


def touching() -> st.SearchStrategy[Scene]:
    """Two to five robots, each in contact with another: a gap of exactly 0 up to rounding."""
    return scenes(st.integers(2, 5), st.just(0.0))


@st.composite
def head_on(draw: st.DrawFn, gaps: st.SearchStrategy[float] | None = None) -> Scene:
    """Two equal robots face to face on the x axis, one speed, opposite velocities, both wanting to go on.

    Args:
        draw: Given by Hypothesis.
        gaps: Free distance in m; those of `GAPS` if None.
    """
    radius, speed = draw(radii()), draw(speeds())
    half = radius + draw(st.sampled_from(GAPS) if gaps is None else gaps) / 2
    velocity = [[speed, 0.0], [-speed, 0.0]]
    return Scene.from_world(
        [[-half, 0.0], [half, 0.0]],
        velocity,
        radius,
        priority=[draw(priorities()), draw(priorities())],
        wanted=velocity,
    )


@st.composite
def symmetric(draw: st.DrawFn) -> Scene:
    """Two robots, each the other turned by 180 degrees about the origin in all but priority; wanted as observed.

    They may approach, pass or part.
    """
    radius = draw(radii())
    half = radius + draw(st.sampled_from(GAPS) | st.floats(0.0, 2.0)) / 2
    angle = draw(angles())
    x, y = half * math.cos(angle), half * math.sin(angle)
    v_x, v_y = draw(velocities())
    velocity = [[v_x, v_y], [-v_x, -v_y]]
    return Scene.from_world(
        [[-x, -y], [x, y]],
        velocity,
        radius,
        priority=[draw(priorities()), draw(priorities())],
        wanted=velocity,
    )


@st.composite
def actions(draw: st.DrawFn, scene: Scene) -> FloatArray:
    """Wanted velocities of all robots, shape (N, 2), up to 2.5 m/s: at or away from another robot, or any."""
    wanted = np.array([draw(velocities(1.25 * MAX_SPEED)) for _ in range(scene.num_robots)])
    for i in range(scene.num_robots):
        aim = draw(st.sampled_from((None, 1.0, -1.0)))
        others = np.flatnonzero(np.arange(scene.num_robots) != i)
        if aim is not None and len(others) > 0:
            offset = scene.position[draw(st.sampled_from(others.tolist()))] - scene.position[i]
            distance = math.hypot(*offset)
            if distance > 0.0:
                wanted[i] = aim * draw(speeds()) / distance * offset
    return wanted.reshape(-1, 2)


@st.composite
def degenerate(draw: st.DrawFn) -> Scene:
    """Two to four robots where formulas lose their footing; robot 0 cooperates.

    Centres coincide, overlap, touch exactly, or stand in one line; velocities are equal, zero, or exactly at the centre
    of the cut-off; priorities are a millionfold apart. Overlap is something that only a step before could have caused,
    so these are for checks of decisions rather than for `rollouts`.
    """
    size = draw(st.integers(2, 4))
    radius = draw(radii())
    # In radii along one line: coinciding, within each other, exactly in contact, apart.
    place = [0.0]
    for _ in range(1, size):
        place.append(place[-1] + radius * draw(st.sampled_from((0.0, 1e-200, 1e-9, 1.0, 2.0, 3.0))))
    velocity = draw(velocities())
    at_cutoff = (place[1] - place[0]) / 2.0 + velocity[0], velocity[1]
    pace = draw(st.sampled_from(((0.0, 0.0), velocity, at_cutoff)))
    return Scene.from_world(
        [[x, 0.0] for x in place],
        [pace] + [velocity] * (size - 1),
        radius,
        priority=[draw(st.sampled_from((1.0, 1e-3, 1e3))) for _ in range(size)],
        cooperative=[True] + [draw(st.sampled_from((True, False))) for _ in range(1, size)],
        wanted=[draw(velocities()) for _ in range(size)],
    )


@st.composite
def adversarial_policies(draw: st.DrawFn, scene: Scene, dt: float) -> Policy:
    """Policies for the robots of a scene: goal-seeking across its middle, ramming, random, mixed, or senseless."""
    across = GoalSeeking.across(scene, dt)
    kinds: tuple[Policy, ...] = (across, Ramming(), UniformRandom())
    return draw(st.sampled_from((*kinds, Mixed(kinds), NotFinite(Ramming()))))


@st.composite
def rollouts(
    draw: st.DrawFn,
    starts: st.SearchStrategy[Scene] | None = None,
    dt: float = 0.2,
    *,
    omega_max: float = 0.0,
) -> Trial:
    """Robots, a policy, top speeds and a few steps, ready for `assert_collision_free`.

    Args:
        draw: Given by Hypothesis.
        starts: Scenes to start from; `scenes` if None.
        dt: Duration of a step, in s.
        omega_max: Largest turn rate of differential drives, in rad/s; 0: robots take any velocity.
    """
    scene = draw(scenes() if starts is None else starts)
    if omega_max > 0.0:
        heading = np.array([draw(angles()) for _ in range(scene.num_robots)])
        scene = replace(scene, heading=heading)
    return Trial(
        scene,
        draw(adversarial_policies(scene, dt)),
        np.array([draw(speeds()) for _ in range(scene.num_robots)]),
        dt=dt,
        num_steps=draw(st.integers(1, MAX_STEPS)),
        seed=draw(st.integers(0, 100)),
        is_single=draw(st.booleans()),
        passive_speed=draw(st.sampled_from((0.0, 0.3))),
        omega_max=omega_max,
    )


def pushed_free(
    anchor: tuple[float, ...],
    direction: tuple[float, ...],
    gap: float,
    place: Sequence[tuple[float, ...]],
    radius: Sequence[float],
) -> tuple[float, ...]:
    """The place for the next robot nearest to ``anchor`` in a direction, at least ``gap`` from everyone."""
    distance, own = 0.0, radius[len(place)]
    while True:
        tried = tuple(a + distance * e for a, e in zip(anchor, direction, strict=True))
        further = distance
        for k, other in enumerate(place):
            clear = own + radius[k] + gap
            if math.dist(tried, other) < clear - 1e-12:
                # Where the ray leaves the disc of that radius around the robot in the way.
                offset = tuple(o - a for o, a in zip(other, anchor, strict=True))
                along = sum(o * e for o, e in zip(offset, direction, strict=True))
                across = math.dist(offset, [along * e for e in direction])
                half = math.sqrt(max(0.0, clear * clear - across * across))
                further = max(further, along + half)
        if further <= distance:
            return tried
        distance = further

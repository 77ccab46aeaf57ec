"""Policies that know nothing of safety, for robots to be driven with: random, ramming, goal-seeking, senseless, mixed.

Each takes what the scene shows and the robots' own top speeds, and proposes a velocity for every robot. They are
records without memory: the same scene and the same random numbers give the same velocities, and their ``repr`` is the
code that makes them.

Letters: N robots, d dimensions: 2, or 3 in space. m, m/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.scene import Scene
from safefilter.scene_arrays import PLANE

# How far beyond their top speed random policies ask to go, as learned policies do.
OVERSPEED = 1.25
# How often `NotFinite` asks for what it asks for.
SPOILT_PART = 0.3
NOT_SENSIBLE = (np.nan, np.inf, -np.inf, 1e30)


class Policy(Protocol):
    """Proposes a velocity for every robot."""

    def act(self, scene: Scene, v_max: FloatArray, rng: np.random.Generator, /) -> FloatArray:
        """Velocities wanted, shape (N, d), in m/s.

        Args:
            scene: What robots know at the start of the step.
            v_max: Top speed of each robot, shape (N,), in m/s.
            rng: The only source of chance.
        """
        ...


@dataclass(frozen=True, slots=True)
class UniformRandom:
    """A new direction at every step, at any speed up to `OVERSPEED` times the top speed."""

    def act(self, scene: Scene, v_max: FloatArray, rng: np.random.Generator, /) -> FloatArray:
        """See `Policy.act`."""
        if scene.dimension > PLANE:
            aim = rng.normal(size=scene.position.shape)
            part = np.cbrt(rng.uniform(0.0, 1.0, scene.num_robots))
            return at_speed(aim, OVERSPEED * v_max * part)
        angle = rng.uniform(0.0, 2.0 * np.pi, scene.num_robots)
        speed = OVERSPEED * v_max * np.sqrt(rng.uniform(0.0, 1.0, scene.num_robots))
        return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=1)


@dataclass(frozen=True, slots=True)
class Ramming:
    """Full speed at the centre of the nearest robot in sight; stands still where there is none."""

    def act(self, scene: Scene, v_max: FloatArray, _rng: np.random.Generator, /) -> FloatArray:
        """See `Policy.act`."""
        seer = np.repeat(np.arange(scene.num_robots), np.diff(scene.neighbour_start))
        offset = scene.position[scene.neighbours] - scene.position[seer]
        gap = np.hypot.reduce(offset, axis=1) - scene.radius[scene.neighbours]
        least = np.full(scene.num_robots, np.inf)
        np.minimum.at(least, seer, gap)
        aim = np.zeros(scene.position.shape)
        is_nearest = gap == least[seer]
        aim[seer[is_nearest]] = offset[is_nearest]
        return at_speed(aim, v_max)


@dataclass(frozen=True, slots=True)
class GoalSeeking:
    """Full speed straight to a goal of one's own, and no further.

    Attributes:
        goal: One point a robot, (x, y) or (x, y, z), in m.
        dt: Duration of a step, in s: the last one ends at the goal.
    """

    goal: tuple[tuple[float, ...], ...]
    dt: float

    @classmethod
    def across(cls, scene: Scene, dt: float) -> GoalSeeking:
        """Everyone to the opposite side of its world, through the middle: the crowd meets there."""
        _, world, size = np.unique(scene.world, return_inverse=True, return_counts=True)
        total = [np.bincount(world, column, minlength=len(size)) for column in scene.position.T]
        middle = np.stack(total, axis=1) / size[:, None]
        goal = 2.0 * middle[world] - scene.position
        return cls(tuple(tuple(point) for point in goal.tolist()), dt)

    def act(self, scene: Scene, v_max: FloatArray, _rng: np.random.Generator, /) -> FloatArray:
        """See `Policy.act`."""
        offset = np.array(self.goal).reshape(scene.position.shape) - scene.position
        distance = np.hypot.reduce(offset, axis=1)
        return at_speed(offset, np.minimum(v_max, distance / self.dt))


@dataclass(frozen=True, slots=True)
class NotFinite:
    """Another policy, but for some robots at some steps: NaN, infinity or a speed beyond all bounds.

    Attributes:
        policy: The other policy.
    """

    policy: Policy

    def act(self, scene: Scene, v_max: FloatArray, rng: np.random.Generator, /) -> FloatArray:
        """See `Policy.act`."""
        wanted = self.policy.act(scene, v_max, rng).copy()
        spoilt = rng.uniform(size=scene.num_robots) < SPOILT_PART
        wanted[spoilt, 0] = rng.choice(NOT_SENSIBLE, int(spoilt.sum()))
        return wanted


@dataclass(frozen=True, slots=True)
class Mixed:
    """Robots take turns in what they follow: robot i follows policy ``i mod len(policies)``.

    Attributes:
        policies: What is mixed, at least one.
    """

    policies: tuple[Policy, ...]

    def act(self, scene: Scene, v_max: FloatArray, rng: np.random.Generator, /) -> FloatArray:
        """See `Policy.act`."""
        proposals = np.stack([policy.act(scene, v_max, rng) for policy in self.policies])
        robots = np.arange(scene.num_robots)
        return proposals[robots % len(self.policies), robots]


def at_speed(aim: FloatArray, speed: FloatArray) -> FloatArray:
    """Velocities along ``aim``, shape (N, d), at ``speed``, shape (N,); zero where the aim is zero."""
    length = np.hypot.reduce(aim, axis=1)
    safe_length = np.where(length > 0.0, length, 1.0)
    return aim / safe_length[:, None] * speed[:, None]

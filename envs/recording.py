"""Recording: where the robots of one world were, moment by moment.

Letters: T moments (the start, and the end of each step), N robots, S walls. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What stays the same throughout an episode.

    Attributes:
        scenario: Name of the scenario.
        seed: What the world was reset with; None where it went on with its generators.
        dt: Duration of a step, in s.
        has_heading: Do robots face a direction, and are actions commands (v, w)? Velocities otherwise.
        goal: Shape (N, 2), in m.
        radius: Shape (N,), in m.
        v_max: Greatest speeds, shape (N,), in m/s.
        priority: Shape (N,).
        person: Shape (N,): walks by a model of its own.
        walls: Shape (S, 2, 2), in m.
    """

    scenario: str
    seed: int | None
    dt: float
    has_heading: bool
    goal: FloatArray
    radius: FloatArray
    v_max: FloatArray
    priority: FloatArray
    person: BoolArray
    walls: FloatArray

    @classmethod
    def of(
        cls, world: World, number: int, dt: float, scenario: str = "", seed: int | None = None
    ) -> Self:
        """Read it from a world that has just been reset.

        Args:
            world: State.
            number: Which world of it.
            dt: Duration of a step, in s.
            scenario: Name of the scenario.
            seed: What it was reset with.
        """
        return cls(
            scenario=scenario,
            seed=seed,
            dt=dt,
            has_heading=world.is_differential,
            goal=frozen(world.goal[number].copy()),
            radius=frozen(world.radius[number].copy()),
            v_max=frozen(world.v_max[number].copy()),
            priority=frozen(world.priority[number].copy()),
            person=frozen(world.person[number].copy()),
            walls=frozen(world.walls_of(number).copy()),
        )

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.radius)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One moment, and what led to it.

    Attributes:
        step: Number of steps since the start.
        position: Shape (N, 2), in m.
        heading: Shape (N,), in rad; only if robots have one.
        arrived: Shape (N,).
        collided: Shape (N,).
        present: Shape (N,).
        action: What robots were told in the step before, shape (N, 2); what people do is not in it.
        case: What a filter did to that, a `safefilter.Case`, or 0 where none decided, shape (N,).
    """

    step: int
    position: FloatArray
    heading: FloatArray
    arrived: BoolArray
    collided: BoolArray
    present: BoolArray
    action: FloatArray
    case: IntArray

    @classmethod
    def of(
        cls,
        world: World,
        number: int,
        action: FloatArray | None = None,
        case: IntArray | None = None,
    ) -> Self:
        """Read the present moment.

        Args:
            world: State.
            number: Which world of it.
            action: Shape (N, 2); None: nothing that is known.
            case: Shape (N,); None: no filter.
        """
        num_robots = world.num_robots
        return cls(
            step=int(world.step_count[number]),
            position=world.position[number].copy(),
            heading=world.heading[number].copy(),
            arrived=world.arrived[number].copy(),
            collided=world.collided[number].copy(),
            present=world.present[number].copy(),
            action=np.zeros((num_robots, 2)) if action is None else np.array(action),
            case=np.zeros(num_robots, dtype=np.int64) if case is None else np.array(case),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """An episode of one world.

    Attributes:
        setting: What stays the same.
        time: Shape (T,), in s.
        position: Shape (T, N, 2), in m.
        heading: Shape (T, N), in rad.
        arrived: Shape (T, N).
        collided: Shape (T, N).
        present: Shape (T, N).
        action: Shape (T, N, 2).
        case: Shape (T, N).
    """

    setting: Setting
    time: FloatArray
    position: FloatArray
    heading: FloatArray
    arrived: BoolArray
    collided: BoolArray
    present: BoolArray
    action: FloatArray
    case: IntArray

    @classmethod
    def of(cls, setting: Setting, moments: Sequence[Moment]) -> Self:
        """Put moments together.

        Args:
            setting: What stays the same.
            moments: One or more.
        """
        arrays = {
            field.name: frozen(np.array([getattr(moment, field.name) for moment in moments]))
            for field in fields(Moment)
            if field.name != "step"
        }
        steps = np.array([moment.step for moment in moments], dtype=np.float64)
        return cls(setting=setting, time=frozen(steps * setting.dt), **arrays)

    @property
    def num_moments(self) -> int:
        """Number of moments T."""
        return len(self.time)

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return self.setting.num_robots


class Recorder:
    """Collects the moments of one world."""

    def __init__(
        self, world: World, number: int, dt: float, scenario: str = "", seed: int | None = None
    ) -> None:
        """Record the moment of the start.

        Args:
            world: State, watched from now on.
            number: Which world of it.
            dt: Duration of a step, in s.
            scenario: Name of the scenario.
            seed: What the world was reset with.
        """
        self._world = world
        self._number = number
        self._setting = Setting.of(world, number, dt, scenario, seed)
        self._moments: list[Moment] = []
        self.record()

    def record(self, action: FloatArray | None = None, case: IntArray | None = None) -> None:
        """Record the present moment.

        Args:
            action: What robots were told in the step before, shape (N, 2).
            case: What a filter did to that, shape (N,).
        """
        self._moments.append(Moment.of(self._world, self._number, action, case))

    def recording(self) -> Recording:
        """All moments so far."""
        return Recording.of(self._setting, self._moments)

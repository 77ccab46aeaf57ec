"""Problems met on the way: consecutive decisions of robots in closed loop, the built-in solver driving.

Letters: N robots. m, m/s, s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.comparison.problem import Problem
from safefilter.comparison.recording import posed_problems
from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.decision import Case
from safefilter.kinematics.holonomic import Holonomic
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Robots on their way to goals of their own, straight ahead at full speed.

    Attributes:
        start: Shape (N, 2), in m.
        goal: Shape (N, 2), in m.
        radius: In m.
        v_max: In m/s.
        dt: Duration of a step, in s.
        time_horizon: In s.
        reach: How far robots see, in m.
        num_steps: Number of steps.
        max_neighbours: Soft rows are cut to this many neighbours.
    """

    start: FloatArray
    goal: FloatArray
    radius: float
    v_max: float
    dt: float
    time_horizon: float
    reach: float
    num_steps: int
    max_neighbours: int

    def safety_filter(self, backend: str = "planar") -> SafetyFilter:
        """The filter that the robots share."""
        return SafetyFilter(
            [
                PriorityORCA(self.time_horizon, max_neighbours=self.max_neighbours),
                Separation(self.dt),
            ],
            Holonomic(self.v_max),
            backend=backend,
        )

    def scene(self, position: FloatArray, velocity: FloatArray) -> Scene:
        """What the robots know."""
        return Scene.from_world(position, velocity, self.radius, reach=self.reach)

    def wanted(self, position: FloatArray) -> FloatArray:
        """Straight to the goal, and no further; shape (N, 2), in m/s."""
        to_goal = self.goal - position
        distance = np.hypot(to_goal[:, 0], to_goal[:, 1])[:, np.newaxis]
        speed = np.minimum(self.v_max, distance / self.dt)
        return to_goal / np.maximum(distance, 1e-12) * speed


def crossroad() -> Course:
    """Four robots in each of four arms, two abreast."""
    rng = np.random.default_rng(1)
    angle = np.repeat(np.arange(4) * (np.pi / 2.0), 4)
    ahead = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    aside = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    aside *= np.tile([-0.15, -0.15, 0.15, 0.15], 4)[:, None]
    distance = np.tile([0.7, 0.96], 8)[:, None]
    start = aside - distance * ahead + rng.uniform(-0.01, 0.01, (16, 2))
    return Course(start, aside + distance * ahead, 0.105, 0.2, 0.2, 2.0, 1.5, 90, 10)


def circle() -> Course:
    """RVO2's example: 250 robots on a circle of 200 m, each to the opposite point."""
    angle = 2.0 * np.pi * np.arange(250) / 250
    start = 200.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Course(start, -start, 1.5, 2.0, 0.25, 10.0, 15.0, 800, 10)


def crowd() -> Course:
    """A full square of 64 robots that all want to get to the opposite side."""
    rng = np.random.default_rng(2)
    columns = 0.25 * (np.arange(8) - 3.5)
    start = np.stack(np.meshgrid(columns, columns), axis=2).reshape(-1, 2)
    start += rng.uniform(-0.015, 0.015, start.shape)
    return Course(start, -start, 0.105, 0.2, 0.2, 2.0, 1.5, 60, 10)


def driven_problems(course: Course, num_robots: int, num_each: int) -> list[Problem]:
    """Let robots drive, and keep consecutive problems of those for whom it becomes tightest.

    Args:
        course: What they drive.
        num_robots: How many of them: the ones with the most decisions of Case-3.
        num_each: How many problems of each, with the first one of Case-3 in the middle.
    """
    safety_filter = course.safety_filter()
    position, velocity = course.start, np.zeros_like(course.start)
    states, cases = [], []
    for _ in range(course.num_steps):
        scene, wanted = course.scene(position, velocity), course.wanted(position)
        decision = safety_filter.decide(scene, wanted)
        states.append((scene, wanted))
        cases.append(decision.case)
        velocity = decision.action.astype(np.float64)
        position = position + course.dt * velocity
    met = np.array(cases)
    num_empty = (met == Case.LEAST_VIOLATION).sum(axis=0)
    chosen: list[Problem] = []
    for robot in np.argsort(-num_empty, kind="stable")[:num_robots].tolist():
        for step in _steps(met[:, robot], num_each):
            scene, wanted = states[step]
            own = wanted[[robot]]
            decision = safety_filter.decide(scene, own, [robot])
            chosen += posed_problems(safety_filter, scene, own, decision)
    return chosen


def _steps(cases: npt.NDArray[np.int8], number: int) -> list[int]:
    """Steps at which a solver was needed, as many as asked for, the first one of Case-3 in the middle."""
    steps = np.flatnonzero(cases != Case.SAFE)
    is_empty = cases[steps] == Case.LEAST_VIOLATION
    first = int(np.argmax(is_empty)) if is_empty.any() else 0
    begin = max(0, min(first - number // 2, len(steps) - number))
    chosen: list[int] = steps[begin : begin + number].tolist()
    return chosen


def head_on_problems(rng: np.random.Generator, number: int) -> list[Problem]:
    """Robots closed in on exactly from ahead and behind, or from all four sides, at full speed and nearly in contact.

    The robot is at the origin; none of the others gives way. They come exactly in line, or off by 1e-12 to 1e-3 of the
    distance.
    """
    course = crossroad()
    safety_filter = course.safety_filter()
    problems: list[Problem] = []
    for k in range(number):
        angle, off = rng.uniform(0.0, 2.0 * np.pi), [0.0, 1e-12, 1e-9, 1e-6, 1e-3][k % 5]
        ahead = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-ahead[1], ahead[0]])
        sides = [ahead, -ahead] + ([across, -across] if k % 2 else [])
        distance = course.radius * (2.0 + rng.uniform(0.05, 0.9))
        position = [np.zeros(2)] + [distance * (side + off * across) for side in sides]
        velocity = [course.v_max * ahead] + [-course.v_max * side for side in sides]
        is_filtered = [True] + [False] * len(sides)
        scene = Scene.from_world(position, velocity, course.radius, cooperative=is_filtered)
        wanted = course.v_max * ahead[np.newaxis]
        decision = safety_filter.decide(scene, wanted, [0])
        problems += posed_problems(safety_filter, scene, wanted, decision, f"{k}: ")
    return problems

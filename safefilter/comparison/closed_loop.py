"""The consequence: robots cross each other's ways, each contender deciding, and an independent judge looks on.

``trusted``: what the solver says executes, as it is; where it says nothing the robot stands still. ``verified``: what
`SafetyFilter` makes of it executes.

Letters: N robots, B decisions. m, m/s, s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import NamedTuple, TypeAlias

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.closest_approach import Approach, closest_approach, pairs_within
from safefilter.comparison.attempt import decide, raw_answer
from safefilter.comparison.contender import Contender, accuracy_of, make_contender
from safefilter.comparison.make_driven import Course
from safefilter.comparison.problem import Problem
from safefilter.decision import Case, Fault
from safefilter.scene import Scene

NUM_ROBOTS = 10
V_MAX = 0.2
DT = 0.2
RADIUS = 0.105
ARRIVED = 0.05
ASIDE = math.radians(20.0)
"""Goals are so far beside the opposite point, all on one side: where all want through the middle, nobody arrives."""


class Crossing(NamedTuple):
    """What came of it.

    Attributes:
        is_verified: Did `SafetyFilter` stand between the solver and the robots?
        min_clearance: Least free distance of two robots at any instant, in m; negative where discs overlap.
        collisions: How often two robots that were apart came into contact.
        arrived: Share of the robots that are at their goals at the end.
        time_to_goal: Mean over those, in s; NaN if there are none.
        decisions: How many decisions a solver was needed for.
        not_own: How many of them the solver did not decide: it said nothing, or the filter refused what it said.
        step_time: Median time that the decisions of one step took in which a solver was needed, in s; NaN if none was.
    """

    is_verified: bool
    min_clearance: float
    collisions: int
    arrived: float
    time_to_goal: float
    decisions: int
    not_own: int
    step_time: float


class _Step(NamedTuple):
    velocity: FloatArray
    decisions: int
    not_own: int
    seconds: float = 0.0


Driver: TypeAlias = Callable[[Scene, FloatArray], _Step]


def crossing() -> Course:
    """Robots on a circle, each to a point `ASIDE` of the opposite one: symmetric but for a few millimetres."""
    rng = np.random.default_rng(3)
    angle = 2.0 * np.pi * np.arange(NUM_ROBOTS) / NUM_ROBOTS
    start = 0.8 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    start += rng.uniform(-0.005, 0.005, start.shape)
    turn = np.array([[math.cos(ASIDE), math.sin(ASIDE)], [-math.sin(ASIDE), math.cos(ASIDE)]])
    return Course(start, -start @ turn, RADIUS, V_MAX, DT, 2.0, 3.0, 120, NUM_ROBOTS)


def drive_across(contender: Contender, *, is_verified: bool, num_steps: int) -> Crossing:
    """Let a contender decide for all robots.

    Args:
        contender: Who. Verified, it decides at the accuracy that `SafetyFilter` asks for, whatever its setting.
        is_verified: See `Crossing`.
        num_steps: Steps at most; it ends when everyone has arrived.
    """
    course = crossing()
    driver = _verified(contender, course) if is_verified else _trusted(contender, course)
    position, velocity = course.start.copy(), np.zeros_like(course.start)
    radius, pairs = np.full(NUM_ROBOTS, RADIUS), pairs_within(np.zeros(NUM_ROBOTS, dtype=np.int64))
    time_to_goal = np.full(NUM_ROBOTS, np.nan)
    steps: list[_Step] = []
    approaches: list[Approach] = []
    while len(steps) < num_steps and np.isnan(time_to_goal).any():
        scene, wanted = course.scene(position, velocity), course.wanted(position)
        start = perf_counter()
        step = driver(scene, wanted)
        steps.append(step._replace(seconds=perf_counter() - start))
        velocity = step.velocity
        approaches.append(closest_approach(position, DT * velocity, radius, pairs))
        position = position + DT * velocity
        there = np.hypot(*(course.goal - position).T) <= ARRIVED
        time_to_goal[there & np.isnan(time_to_goal)] = len(steps) * DT
    arrived = time_to_goal[~np.isnan(time_to_goal)]
    times = [step.seconds for step in steps if step.decisions]
    return Crossing(
        is_verified=is_verified,
        min_clearance=min(float(approach.least.min()) for approach in approaches),
        collisions=sum(int(approach.collided.sum()) for approach in approaches),
        arrived=len(arrived) / NUM_ROBOTS,
        time_to_goal=float(arrived.mean()) if len(arrived) else math.nan,
        decisions=sum(step.decisions for step in steps),
        not_own=sum(step.not_own for step in steps),
        step_time=float(np.median(times)) if times else math.nan,
    )


def _verified(contender: Contender, course: Course) -> Driver:
    safety_filter = course.safety_filter(contender.backend)

    def drive(scene: Scene, wanted: FloatArray) -> _Step:
        decision = safety_filter.decide(scene, wanted)
        is_open = decision.case != Case.SAFE
        faults = decision.fault[is_open] != Fault.NONE
        velocity = decision.action.astype(np.float64)
        return _Step(velocity, int(is_open.sum()), int(faults.sum()))

    return drive


def _trusted(contender: Contender, course: Course) -> Driver:
    rows_of, accuracy = course.safety_filter().half_spaces, accuracy_of(course.v_max)
    solvers = make_contender(contender, course.v_max)

    def drive(scene: Scene, wanted: FloatArray) -> _Step:
        rows, velocity, not_own = rows_of(scene, wanted, None), wanted.copy(), 0
        is_open = rows.violation(wanted).max(axis=1) > accuracy
        for k in np.flatnonzero(is_open).tolist():
            present = rows.present[k]
            problem = Problem.of(
                f"robot {k}",
                wanted[k],
                rows.normals[k][present],
                rows.offsets[k][present],
                rows.hard[k][present],
                scale=course.v_max,
                radius=course.v_max,
            )
            point = raw_answer(decide(solvers, problem, perf_counter()).seen, 2, accuracy).point
            is_there = bool(np.isfinite(point).all())
            velocity[k] = point if is_there else 0.0
            not_own += not is_there
        return _Step(velocity, int(is_open.sum()), not_own)

    return drive

"""Agent-steps a second of the simulator: 36 beams, 8 robots a world, step and observation, filter off and on.

An agent-step is one robot moved by one step of 0.2 s, collisions judged inside the step, and its new observation of 90
numbers made. Robots are differential drives at the walled crossroad, driven to their goals; worlds that are over
are reset within the time that counts, though not in the best round.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numba
import numpy as np

from benchmarks.other_simulators import other_simulators
from benchmarks.results import Result, Row
from benchmarks.timing import interleaved, on_threads
from envs import Circle, Crossroad, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED, MAX_TURN_RATE
from envs.steering import steer
from safefilter import (
    Constraint,
    DifferentialDrive,
    PriorityORCA,
    SafetyFilter,
    Separation,
    StaticObstacles,
)

WORLDS = (1, 8, 64, 512, 4096)
QUICK_WORLDS = (8, 256)
CROWDS = (2, 8, 50, 500)
NUM_ROBOTS = 8
NUM_BEAMS = 36
# Steps in one round; the rates are of the best round.
STEPS = 10
ROUNDS = 7
QUICK_ROUNDS = 3
# Robots in all, when the number of robots a world is varied.
ROBOTS_IN_ALL = 2000
DT = 0.2


def measure(*, quick: bool = False) -> Result:
    """Time all sizes, on one thread and on two, without the filter and with it, and what others offer.

    Args:
        quick: Two sizes, few rounds.
    """
    rounds = QUICK_ROUNDS if quick else ROUNDS
    rows: list[Row] = []
    for num_worlds in QUICK_WORLDS if quick else WORLDS:
        case = Case(Crossroad(is_walled=True), num_worlds)
        rows.extend(_rows(case, f"{num_worlds} worlds of {NUM_ROBOTS} robots", rounds))
    for num_robots in CROWDS[1::2] if quick else CROWDS:
        case = Case(Circle(num_robots), max(1, ROBOTS_IN_ALL // num_robots))
        rows.extend(_rows(case, f"circle, {num_robots} robots a world", rounds))
    rows.extend(other_simulators(rounds))
    return Result(
        name="simulator",
        title="Agent-steps a second, in thousands: step and observation with 36 beams",
        ratio_of="one thread without the filter, 8 worlds",
        rows=_with_ratios(rows),
        notes=(
            "Differential drives at the walled crossroad (12 walls); observation of 90 numbers. Best of all rounds.",
            "Filter: PriorityORCA, Separation and StaticObstacles, scenes and decisions of all robots included.",
            f"Circles have no walls, {ROBOTS_IN_ALL} robots in all. Too little work stays on one thread.",
            "Others: the nearest equal world that each offers, described in benchmarks/other_simulators.py.",
        ),
    )


@dataclass(frozen=True, slots=True)
class Case:
    """Worlds to step.

    Attributes:
        scenario: Places the robots.
        num_worlds: Number of worlds.
    """

    scenario: Crossroad | Circle
    num_worlds: int

    def started(self) -> Navigation:
        """Worlds at their start."""
        fleet = Fleet.of(self.scenario.num_robots, kinematics="differential")
        navigation = Navigation(self.scenario, fleet, Rules(dt=DT), num_worlds=self.num_worlds)
        navigation.reset(0)
        return navigation

    @property
    def num_robots(self) -> int:
        """Robots in all."""
        return self.num_worlds * self.scenario.num_robots


def make_filter() -> SafetyFilter:
    """The filter of differential drives between walls."""
    constraints: list[Constraint] = [PriorityORCA(2.0), Separation(DT), StaticObstacles(1.0)]
    return SafetyFilter(
        constraints, DifferentialDrive(MAX_SPEED, MAX_TURN_RATE, DT, tracking_error=0.05)
    )


def drive(navigation: Navigation, safety_filter: SafetyFilter | None, num_steps: int) -> None:
    """Drive straight to the goals, observing after each step; worlds that are over start anew."""
    world = navigation.world
    for _ in range(num_steps):
        actions = navigation.wanted(steer(world, world.preferred_velocity()))
        if safety_filter is not None:
            cooperative = world.cooperative.ravel()
            index = np.flatnonzero(cooperative)
            rows = actions.reshape(-1, 2)
            rows[index] = safety_filter.decide(navigation.scenes(), rows[index], index).action
        outcome = navigation.step(actions)
        ended = outcome.over | outcome.timed_out
        if ended.any():
            navigation.reset(worlds=ended)
        navigation.observe()


def _rows(case: Case, group: str, rounds: int) -> Iterator[Row]:
    safety_filter = make_filter()
    for threads in (1, 2)[: numba.get_num_threads()]:
        # From the same starts: what a step costs depends on how many robots meet.
        plain, filtered = case.started(), case.started()
        actions: dict[str, Callable[[], object]] = {
            "filter off": partial(drive, plain, None, STEPS),
            "filter on": partial(drive, filtered, safety_filter, STEPS),
        }
        with on_threads(threads):
            times = interleaved(actions, rounds=rounds)
        for name, taken in times.items():
            label = f"{name}, {threads} thread{'s' if threads > 1 else ''}"
            rate = STEPS * case.num_robots / taken
            yield Row(label, group, {"best": rate.max() / 1e3, "median": np.median(rate) / 1e3})


def _with_ratios(rows: list[Row]) -> tuple[Row, ...]:
    base = rows[0].numbers["best"]
    return tuple(Row(row.name, row.group, row.numbers, row.numbers["best"] / base) for row in rows)

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
from benchmarks.simulated_scenarios import (
    FURTHEST_FAR_WALL,
    NEAREST_FAR_WALL,
    NUM_ROBOTS,
    PAIR_DISTANCE,
    Pairs,
    WithFarWalls,
)
from benchmarks.timing import interleaved, on_threads
from envs import Circle, Crossroad, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED, MAX_TURN_RATE
from envs.scenarios import Scenario
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
# Worlds that have walls which no sensor reaches.
NUM_FAR_WORLDS = 64
FAR = (
    WithFarWalls(0),
    WithFarWalls(500),
    WithFarWalls(5000),
    WithFarWalls(5000, is_listed_around=False),
)
NUM_BEAMS = 36
# Steps in one round; the rates are of the best round. In more steps resets come, which cost by the world.
STEPS = 10
ROUNDS = 9
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
    by_worlds = tuple(_cost_of_a_call(rows))
    for num_robots in CROWDS[1::2] if quick else CROWDS:
        num_worlds = max(1, ROBOTS_IN_ALL // num_robots)
        case = Case(Pairs(num_robots), num_worlds)
        rows.extend(_rows(case, f"pairs, {num_robots} robots a world", rounds))
        case = Case(Circle(num_robots), num_worlds)
        group = f"circle, {num_robots} robots a world, {case.num_in_reach:.0f} within reach"
        rows.extend(_rows(case, group, rounds))
    for far in FAR[:2] if quick else FAR:
        case = Case(far, 1 if quick else NUM_FAR_WORLDS)
        group = f"{case.num_worlds} worlds of {NUM_ROBOTS} robots, and {far.about}"
        rows.extend(_rows(case, group, rounds))
    rows.extend(other_simulators(rounds))
    return Result(
        name="simulator",
        title="Agent-steps a second, in thousands: step and observation with 36 beams",
        ratio_of="one thread without the filter, 8 worlds of 8 robots",
        rows=_with_ratios(rows, f"{QUICK_WORLDS[0]} worlds of {NUM_ROBOTS} robots"),
        notes=(
            "Differential drives at the walled crossroad (12 walls); observation of 90 numbers. Best of all rounds.",
            "Filter: PriorityORCA, Separation and StaticObstacles, scenes and decisions of all robots included.",
            f"Pairs and circles have no walls, {ROBOTS_IN_ALL} robots in all. Pairs of robots stand {PAIR_DISTANCE} m "
            "apart: whatever the number a world, each meets one other, and the work is the same. Robots of a circle "
            "have more within reach of their lidars the larger it is. Too little work stays on one thread.",
            f"Walls far away: {NEAREST_FAR_WALL:.0f} to {FURTHEST_FAR_WALL:.0f} m from the middle of the same "
            f"crossroad, where lidars reach {Rules().lidar_range} m.",
            *by_worlds,
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

    scenario: Scenario
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

    @property
    def num_in_reach(self) -> float:
        """Robots that a lidar reaches at the start, on average."""
        world = self.started().world
        offset = world.position[0, :, np.newaxis] - world.position[0]
        is_near = np.hypot(offset[..., 0], offset[..., 1]) <= Rules().lidar_range
        return float(is_near.sum(axis=1).mean()) - 1.0


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
        actions = steer(world, world.preferred_velocity())
        if safety_filter is not None:
            actions = navigation.wanted(actions)
            actions, _ = navigation.decide(safety_filter, actions)
        outcome = navigation.step(actions)
        if outcome.ends.any():
            navigation.reset(worlds=outcome.over | outcome.timed_out)
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


def _cost_of_a_call(rows: list[Row]) -> Iterator[str]:
    """Part the time of a step of the worlds measured so far into that of a call and that of a robot, one thread."""
    for name in ("filter off", "filter on"):
        measured = [row for row in rows if row.name == f"{name}, 1 thread"]
        robots = np.array([NUM_ROBOTS * int(row.group.split()[0]) for row in measured])
        step = robots * 1e3 / np.array([row.numbers["best"] for row in measured])  # us
        # Least squares of the relative errors: else the largest number of worlds alone decided.
        parts = np.stack([np.ones(len(robots)), robots], axis=1) / step[:, np.newaxis]
        call, robot = np.linalg.lstsq(parts, np.ones(len(robots)), rcond=None)[0]
        off = np.abs((call + robot * robots) / step - 1.0).max()
        yield (
            f"One thread, {name}: a step takes {call:.0f} us for the calls from Python and {robot:.2f} us a robot, "
            f"whatever the number of worlds: within {100.0 * off:.0f} % of all that were measured."
        )


def _with_ratios(rows: list[Row], base_group: str) -> tuple[Row, ...]:
    """Ratios to the first row of a group."""
    base = next(row for row in rows if row.group == base_group).numbers["best"]
    return tuple(Row(row.name, row.group, row.numbers, row.numbers["best"] / base) for row in rows)

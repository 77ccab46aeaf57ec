"""Long runs of differential drives between walls: every combination in turn, sizes and the rest by chance.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle, product
from typing import Literal, NamedTuple

import numpy as np

from envs import Corridor, Doorway, Fleet, Rules, UShape
from envs.dynamics import Kinematics
from envs.scenarios import Packed, Scenario
from envs.scenarios.packed import Layout
from policies.bang_bang import BangBang
from policies.policy import Policy
from policies.ramming import Ramming
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom
from safefilter import (
    Constraint,
    DifferentialDrive,
    Holonomic,
    Lidar,
    PriorityORCA,
    SafetyFilter,
    Separation,
    StaticObstacles,
)
from safefilter.arrays import FloatArray
from safefilter.constraints.priority_orca import Leg, VOpt
from safefilter.kinematics.differential_drive import Mapping

LayoutName = Literal["box", "corridor", "doorway", "U shape"]

LAYOUTS: tuple[LayoutName, ...] = ("box", "corridor", "doorway", "U shape")
POLICIES: tuple[Policy, ...] = (UniformRandom(), BangBang(), Ramming(), StraightToGoal())
MAPPINGS: tuple[Mapping, ...] = ("cut", "polygon")
# Beams of the lidar from which alone robots know walls; 0: they have the map.
BEAMS = (0, 360)
SINGLE = (False, True)
V_OPTS: tuple[VOpt, ...] = ("current", "shared", "own")
LEGS: tuple[Leg, ...] = ("nearest", "norm")

MIN_ROBOTS, MAX_ROBOTS = 2, 50
RADII = (0.05, 0.3)  # m
SPEEDS = (0.1, 1.0)  # m/s
# Priorities of 1e-3 to 1e3, and in every world one robot of each: ratios of 1e6.
PRIORITY_DECADES = 3.0
PASSIVE_SHARE = 0.15
# Free distance to what a robot is put down beside, in m.
GAPS = (0.0, 1e-6, 0.05, 0.5)
# Part of the floor that robots stand on, at most.
FILLED_PART = 0.2
# Of a turn within one step: the drive takes less than half.
SHARPEST_TURN = 3.0  # rad
LONG_RUN = 200_000
MOST_STEPS, LEAST_STEPS = 25, 10
LEAST_ROBOTS = 8


@dataclass(frozen=True, slots=True, eq=False)
class DriveTrial:
    """One run of W worlds, and how its filter is put together.

    Attributes:
        name: Layout, policy and so on, to be read.
        scenario: Walls and starts.
        fleet: The robots.
        rules: Step and lidar.
        policy: Drives all robots.
        kinematics: What the filter knows of how robots move.
        orca: Soft rows.
        wall_horizon: Of `StaticObstacles`, in s; 0: without.
        passive_speed: Stated bound on the speed of robots that do not cooperate, in m/s.
        is_single: Are actions float32? float64 otherwise.
        num_worlds: Number of worlds W.
        num_steps: Number of steps.
        seed: Seed of starts and policy.
    """

    name: str
    scenario: Scenario
    fleet: Fleet
    rules: Rules
    policy: Policy
    kinematics: DifferentialDrive | Holonomic
    orca: PriorityORCA
    wall_horizon: float
    passive_speed: float
    is_single: bool
    num_worlds: int
    num_steps: int
    seed: int

    def safety_filter(self, *, has_separation: bool = True) -> SafetyFilter:
        """Make the filter; without separation there is nothing that the arcs are cut to."""
        constraints: list[Constraint] = [self.orca]
        if has_separation:
            constraints.append(Separation(self.rules.dt, passive_speed=self.passive_speed))
        if self.wall_horizon > 0.0:
            constraints.append(StaticObstacles(self.wall_horizon))
        return SafetyFilter(constraints, self.kinematics)


class Combination(NamedTuple):
    """What is gone through in turn; see `COMBINATIONS`.

    Attributes:
        layout: What kind of walls.
        policy: Drives all robots.
        mapping: Of the drives; holonomic robots have none, and one speed for all with "polygon" as well.
        num_beams: Of lidars; 0: robots have the map.
        is_single: Are actions float32?
    """

    layout: LayoutName
    policy: Policy
    mapping: Mapping
    num_beams: int
    is_single: bool


class Size(NamedTuple):
    """How much is driven in a trial.

    Attributes:
        num_robots: Robots in all worlds together, as far as whole worlds allow.
        num_steps: Number of steps.
        most_robots: In one world, at most.
    """

    num_robots: int
    num_steps: int
    most_robots: int = MAX_ROBOTS


COMBINATIONS = tuple(
    Combination(*choice) for choice in product(LAYOUTS, POLICIES, MAPPINGS, BEAMS, SINGLE)
)


def drive_trials(seed: int, robot_steps: int) -> Iterator[DriveTrial]:
    """Draw trials without end, of a size such that ``robot_steps`` see every combination."""
    rng = np.random.default_rng(seed)
    num_steps = MOST_STEPS if robot_steps >= LONG_RUN else LEAST_STEPS
    # Trials turn out larger than asked for by up to a world: half the size leaves room for that.
    wished = max(robot_steps // (2 * len(COMBINATIONS) * num_steps), LEAST_ROBOTS)
    order = cycle(rng.permutation(len(COMBINATIONS)).tolist())
    for number, chosen in enumerate(order):
        yield drive_trial(rng, COMBINATIONS[chosen], Size(wished, num_steps), seed + number)


def drive_trial(
    rng: np.random.Generator,
    combination: Combination,
    size: Size,
    seed: int,
    *,
    kinematics: Kinematics = "differential",
) -> DriveTrial:
    """Draw one trial.

    Args:
        rng: Source of chance: of the robots, the walls, and the filter.
        combination: What is given.
        size: How much is driven.
        seed: Seed of starts and policy.
        kinematics: How robots move.
    """
    dt = float(rng.choice([0.1, 0.2]))
    fleet = _random_fleet(rng, dt, combination, size.most_robots, kinematics)
    num_worlds = max(1, size.num_robots // fleet.num_robots)
    return DriveTrial(
        name=name_of(combination, kinematics),
        scenario=Packed(
            layout_of(combination.layout, fleet, dt, rng), fleet.radius, float(rng.choice(GAPS))
        ),
        fleet=fleet,
        rules=Rules(dt=dt, num_beams=combination.num_beams),
        policy=combination.policy,
        kinematics=_random_drive(rng, fleet, num_worlds, dt, combination.mapping),
        orca=PriorityORCA(
            2.0, V_OPTS[rng.integers(len(V_OPTS))], leg=LEGS[rng.integers(len(LEGS))]
        ),
        wall_horizon=float(rng.choice([0.0, 1.0])),
        passive_speed=float(rng.choice([0.0, fleet.v_max.max()])),
        is_single=combination.is_single,
        num_worlds=num_worlds,
        num_steps=size.num_steps,
        seed=seed,
    )


def name_of(combination: Combination, kinematics: Kinematics) -> str:
    """What a trial is called."""
    bits = "32" if combination.is_single else "64"
    moves = combination.mapping if kinematics == "differential" else kinematics
    return f"{combination.layout}, {combination.policy.name}, {moves}, {combination.num_beams} beams, {bits} bits"


def layout_of(layout: LayoutName, fleet: Fleet, dt: float, rng: np.random.Generator) -> Layout:
    """Draw walls with room for the robots, and thick enough for a lidar.

    Args:
        layout: What kind of walls.
        fleet: The robots.
        dt: Duration of a step, in s.
        rng: Source of chance.
    """
    largest = float(fleet.radius.max())
    area = float(np.pi * (fleet.radius**2).sum()) / FILLED_PART
    thinnest = least_thickness(fleet, dt)
    thickness = thinnest * (max(0.3, thinnest) / thinnest) ** float(rng.uniform())
    if layout == "box":
        side = np.sqrt(area) + 4.0 * largest
        return Corridor(2, length=side, width=side)
    if layout == "corridor":
        width = float(rng.uniform(2.5, 6.0)) * largest
        return Corridor(2, length=area / width + 6.0 * largest, width=width)
    if layout == "doorway":
        room_size = np.sqrt(0.5 * area) + 4.0 * largest
        door_width = float(rng.uniform(2.05, 3.9)) * largest
        return Doorway(2, room_size=room_size, door_width=door_width, thickness=thickness)
    depth, width = (rng.uniform(2.5, 8.0, 2) * largest).tolist()
    return UShape(2 * int(np.ceil(np.sqrt(area))), depth=depth, width=width, thickness=thickness)


def least_thickness(fleet: Fleet, dt: float) -> float:
    """Thickness of walls that a lidar needs for everything within a step's reach of a robot, in m."""
    scan = Lidar.scan(np.full((1, max(BEAMS)), np.inf))
    return scan.least_thickness(float(fleet.radius.max() + fleet.v_max.max() * dt))


def _random_fleet(
    rng: np.random.Generator,
    dt: float,
    combination: Combination,
    most_robots: int,
    kinematics: Kinematics,
) -> Fleet:
    is_uniform = combination.mapping == "polygon"
    num_robots = int(_log_uniform(rng, (MIN_ROBOTS, most_robots + 1), 1)[0])
    fastest = float(_log_uniform(rng, SPEEDS, 1)[0])
    priority = 10.0 ** rng.uniform(-PRIORITY_DECADES, PRIORITY_DECADES, num_robots)
    priority[[0, -1]] = 10.0**PRIORITY_DECADES, 10.0**-PRIORITY_DECADES
    cooperative = rng.uniform(size=num_robots) >= PASSIVE_SHARE
    # Someone has to be filtered.
    cooperative[[0, -1]] = True
    return Fleet.of(
        num_robots,
        radius=float(_log_uniform(rng, RADII, 1)[0]) * rng.uniform(0.5, 1.0, num_robots),
        v_max=fastest * (1.0 if is_uniform else rng.uniform(0.5, 1.0, num_robots)),
        priority=priority,
        cooperative=cooperative,
        omega_max=float(rng.choice([1.0, 2.5, SHARPEST_TURN / dt])),
        kinematics=kinematics,
    )


def _random_drive(
    rng: np.random.Generator, fleet: Fleet, num_worlds: int, dt: float, mapping: Mapping
) -> DifferentialDrive | Holonomic:
    if fleet.kinematics == "holonomic":
        return Holonomic(np.tile(fleet.v_max, num_worlds))
    is_uniform = mapping == "polygon"
    return DifferentialDrive(
        float(fleet.v_max[0]) if is_uniform else np.tile(fleet.v_max, num_worlds),
        float(fleet.omega_max[0]),
        dt,
        float(rng.choice([0.01, 0.02, 0.1])),
        float(rng.choice([dt, 0.3, 0.5])),
        mapping=mapping,
    )


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float], size: int) -> FloatArray:
    low, high = limits
    return np.asarray(low * (high / low) ** rng.uniform(size=size))

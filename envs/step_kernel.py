"""One step of many worlds, in one pass: move, judge, stop, arrive, be reborn.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from envs.arcs import arc_point
from envs.collision_kernel import ContactArrays, StepArrays, judge_robots, judge_walls
from envs.dynamics import start_motion
from envs.robot_grid_kernel import RobotGrid, empty_robot_grid, sort_robots
from envs.under_way import is_under_way
from envs.walls import WallArrays, most_entries
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import array_formula, formula, kernel
from safefilter.kept import KeptRecord

YIELD, PARK, VANISH, REBORN = range(4)
"""Numbers of `envs.rules.AfterArrival`, in its order."""


class RobotArrays(NamedTuple):
    """What a step reads and writes of an `envs.world.World`; the names are its own."""

    position: FloatArray
    velocity: FloatArray
    heading: FloatArray
    turn_rate: FloatArray
    goal: FloatArray
    radius: FloatArray
    v_max: FloatArray
    omega_max: FloatArray
    priority: FloatArray
    cooperative: BoolArray
    present: BoolArray
    arrived: BoolArray
    collided: BoolArray
    arrival_time: FloatArray
    person: BoolArray
    start: FloatArray
    start_heading: FloatArray
    arrivals: IntArray
    cycle_start: IntArray
    spin_way: FloatArray
    spin_turn: FloatArray
    step_count: IntArray


class StepSettings(NamedTuple):
    """Numbers of `envs.rules.Rules`.

    Attributes:
        dt: Duration of the step, in s.
        goal_radius: In m.
        horizon: Free distance up to which clearances are reported, in m.
        max_steps: Steps of an episode.
        spin_steps: The last of them, over which rotating in place is judged.
        spin_distance: In m.
        spin_angle: In rad.
        birth_gap: In m.
        after_arrival: Number of the rule.
        wrecks_vanish: See `Rules`.
        drives: Are robots differential drives? People never are.
    """

    dt: float
    goal_radius: float
    horizon: float
    max_steps: int
    spin_steps: int
    spin_distance: float
    spin_angle: float
    birth_gap: float
    after_arrival: int
    wrecks_vanish: bool
    drives: bool


class Motion(NamedTuple):
    """Working space: velocities at the start, and the rest as in `StepArrays`."""

    velocity: FloatArray
    displacement: FloatArray
    turn: FloatArray
    travel: FloatArray


class StepInputs(NamedTuple):
    """What steps go by.

    Attributes:
        robots: State, which a step writes to.
        cooperates: Does each robot of the fleet cooperate? Shape (N,).
        walls: Walls of all worlds.
        settings: Rules.
        motion: Working space.
    """

    robots: RobotArrays
    cooperates: BoolArray
    walls: WallArrays
    settings: StepSettings
    motion: Motion


class OutcomeArrays(NamedTuple):
    """What a step writes of an `envs.outcome.Outcome`, besides the contacts; the names are its own."""

    collided: BoolArray
    arrived: BoolArray
    cycle_time: FloatArray
    reborn: BoolArray
    rotated: BoolArray
    over: BoolArray
    timed_out: BoolArray


@array_formula
def named_blocks(blocks: tuple[Any, ...]) -> tuple[ContactArrays, OutcomeArrays]:
    """Name what is in the blocks of an outcome: the contacts, and the rest."""
    numbers, flags, ends, num_contacts = blocks
    contacts = ContactArrays(numbers[0], numbers[1], flags[1], flags[2], numbers[3], num_contacts)
    return contacts, OutcomeArrays(
        flags[0], flags[3], numbers[2], flags[4], flags[5], ends[0], ends[1]
    )


@formula
def forget_world(contacts: ContactArrays, outcome: OutcomeArrays, w: int) -> None:
    """Nothing has happened yet: no contact, and nobody near."""
    contacts.num_pairs[w] = 0
    for i in range(contacts.fraction.shape[1]):
        contacts.clearance[w, i], contacts.wall_clearance[w, i] = math.inf, math.inf
        contacts.touched[w, i], contacts.hit_wall[w, i] = False, False
        contacts.fraction[w, i] = 1.0
        outcome.collided[w, i], outcome.arrived[w, i] = False, False
        outcome.cycle_time[w, i] = math.nan
        outcome.reborn[w, i], outcome.rotated[w, i] = False, False


@formula
def can_move(robots: RobotArrays, w: int, i: int, after_arrival: int) -> bool:
    """Does a robot execute what it is told? Wrecks do not, nor do those that their arrival parks."""
    if not robots.present[w, i] or robots.collided[w, i]:
        return False
    return after_arrival == YIELD or not robots.arrived[w, i]


@formula
def plan_world(
    robots: RobotArrays, motion: Motion, settings: StepSettings, action: FloatArray, w: int
) -> None:
    """Write the movements that actions ask for, as far as motors deliver them."""
    for i in range(robots.radius.shape[1]):
        x, y, turn_rate = 0.0, 0.0, 0.0
        if can_move(robots, w, i, settings.after_arrival):
            x, y, turn_rate = start_motion(
                action[w, i, 0],
                action[w, i, 1],
                robots.heading[w, i],
                settings.drives and not robots.person[w, i],
                robots.v_max[w, i],
                robots.omega_max[w, i],
            )
        motion.velocity[w, i, 0], motion.velocity[w, i, 1] = x, y
        motion.displacement[w, i, 0] = settings.dt * x
        motion.displacement[w, i, 1] = settings.dt * y
        motion.turn[w, i] = settings.dt * turn_rate
        motion.travel[w, i] = settings.dt * math.sqrt(x * x + y * y)


@formula
def wrapped(angle: float) -> float:
    """The same angle within half a turn of 0; one that is there already stays bit for bit."""
    return math.atan2(math.sin(angle), math.cos(angle)) if abs(angle) > math.pi else angle


@formula
def advance_robot(
    robots: RobotArrays, motion: Motion, settings: StepSettings, fraction: float, w: int, i: int
) -> None:
    """Move a robot along its arc, as far as its first contact."""
    d_x, d_y = motion.displacement[w, i, 0], motion.displacement[w, i, 1]
    turn = motion.turn[w, i]
    x, y = arc_point(d_x, d_y, turn, fraction)
    robots.position[w, i, 0] += x
    robots.position[w, i, 1] += y
    robots.heading[w, i] = wrapped(robots.heading[w, i] + fraction * turn)
    robots.turn_rate[w, i] = turn / settings.dt
    robots.velocity[w, i, 0], robots.velocity[w, i, 1] = arc_point(
        motion.velocity[w, i, 0], motion.velocity[w, i, 1], turn, 1.0
    )
    if robots.step_count[w] > settings.max_steps - settings.spin_steps:
        robots.spin_way[w, i] += fraction * motion.travel[w, i]
        robots.spin_turn[w, i] += fraction * abs(turn)


@formula
def stop(robots: RobotArrays, w: int, i: int) -> None:
    """A robot stands still from now on, and does not cooperate."""
    robots.velocity[w, i, 0], robots.velocity[w, i, 1] = 0.0, 0.0
    robots.turn_rate[w, i] = 0.0
    robots.cooperative[w, i] = False


@formula
def advance_world(
    robots: RobotArrays,
    motion: Motion,
    settings: StepSettings,
    contacts: ContactArrays,
    outcome: OutcomeArrays,
    w: int,
) -> None:
    """Move all robots, and stop those that touched something."""
    for i in range(robots.radius.shape[1]):
        advance_robot(robots, motion, settings, contacts.fraction[w, i], w, i)
        touched = contacts.touched[w, i] or contacts.hit_wall[w, i]
        if touched and not robots.collided[w, i]:
            outcome.collided[w, i] = True
            robots.collided[w, i] = True
            stop(robots, w, i)
            if settings.wrecks_vanish:
                robots.present[w, i] = False


@formula
def is_active(robots: RobotArrays, w: int, i: int) -> bool:
    """Is robot i of world w under way?"""
    return is_under_way(
        robots.present[w, i], robots.arrived[w, i], robots.collided[w, i], robots.person[w, i]
    )


@formula
def mark_arrivals(
    robots: RobotArrays, settings: StepSettings, outcome: OutcomeArrays, w: int
) -> None:
    """Find who has reached its goal, and do with it what the rules say."""
    for i in range(robots.radius.shape[1]):
        if not is_active(robots, w, i):
            continue
        x = robots.goal[w, i, 0] - robots.position[w, i, 0]
        y = robots.goal[w, i, 1] - robots.position[w, i, 1]
        if math.hypot(x, y) > settings.goal_radius:
            continue
        outcome.arrived[w, i] = True
        robots.arrived[w, i] = True
        robots.arrivals[w, i] += 1
        cycle = robots.step_count[w] - robots.cycle_start[w, i]
        outcome.cycle_time[w, i] = cycle * settings.dt
        if robots.arrivals[w, i] == 1:
            robots.arrival_time[w, i] = robots.step_count[w] * settings.dt
        if settings.after_arrival != YIELD:
            stop(robots, w, i)
        if settings.after_arrival == VANISH:
            robots.present[w, i] = False


@formula
def is_free(robots: RobotArrays, w: int, i: int, gap: float) -> bool:
    """Does nobody else stand where robot i started?"""
    for j in range(robots.radius.shape[1]):
        if j == i or not robots.present[w, j]:
            continue
        x = robots.position[w, j, 0] - robots.start[w, i, 0]
        y = robots.position[w, j, 1] - robots.start[w, i, 1]
        if math.hypot(x, y) < robots.radius[w, i] + robots.radius[w, j] + gap:
            return False
    return True


@formula
def give_birth(
    robots: RobotArrays,
    settings: StepSettings,
    outcome: OutcomeArrays,
    cooperates: BoolArray,
    w: int,
) -> None:
    """Put robots that wait at their goals back to their starts, in order, where those are free."""
    for i in range(robots.radius.shape[1]):
        is_waiting = robots.arrived[w, i] and not robots.collided[w, i]
        if not is_waiting or not is_free(robots, w, i, settings.birth_gap):
            continue
        outcome.reborn[w, i] = True
        robots.position[w, i, 0], robots.position[w, i, 1] = (
            robots.start[w, i, 0],
            robots.start[w, i, 1],
        )
        robots.heading[w, i] = robots.start_heading[w, i]
        robots.arrived[w, i] = False
        robots.cooperative[w, i] = cooperates[i]
        robots.cycle_start[w, i] = robots.step_count[w]
        robots.spin_way[w, i], robots.spin_turn[w, i] = 0.0, 0.0


@formula
def close_step(robots: RobotArrays, settings: StepSettings, outcome: OutcomeArrays, w: int) -> None:
    """Say whether the episode is over, and who has rotated in place."""
    is_over, is_late = True, robots.step_count[w] >= settings.max_steps
    for i in range(robots.radius.shape[1]):
        if is_active(robots, w, i):
            is_over = False
            has_spun = robots.spin_turn[w, i] > settings.spin_angle
            outcome.rotated[w, i] = (
                is_late and has_spun and robots.spin_way[w, i] < settings.spin_distance
            )
        elif settings.after_arrival == REBORN and robots.arrived[w, i]:
            is_over = is_over and robots.collided[w, i]
    outcome.over[w], outcome.timed_out[w] = is_over, is_late


@kernel
def step_worlds(
    action: FloatArray,
    kept: KeptRecord,
    blocks: tuple[Any, ...],
    first_world: int,
    last_world: int,
) -> None:
    """Step worlds [first, last).

    Args:
        action: What robots are told, shape (W, N, 2).
        kept: `StepInputs`.
        blocks: An `envs.outcome.Outcome` without its names, which numba tells four times as fast; written to.
        first_world: The first one.
        last_world: One past the last one.
    """
    inputs: StepInputs = kept.record
    grid = empty_robot_grid(inputs.robots.radius.shape[1])
    squared = np.empty(most_entries(inputs.walls))
    contacts, outcome = named_blocks(blocks)
    step_range(inputs, action, contacts, outcome, grid, squared, first_world, last_world)


@formula
def step_range(
    inputs: StepInputs,
    action: FloatArray,
    contacts: ContactArrays,
    outcome: OutcomeArrays,
    grid: RobotGrid,
    squared: FloatArray,
    first_world: int,
    last_world: int,
) -> None:
    """As `step_worlds`, with room to work in. A formula: to count references to all arrays takes half a microsecond."""
    robots, walls, settings, motion = inputs.robots, inputs.walls, inputs.settings, inputs.motion
    step = StepArrays(
        robots.position,
        motion.displacement,
        motion.turn,
        motion.travel,
        robots.radius,
        robots.present,
        robots.collided,
        robots.person,
    )
    for w in range(first_world, last_world):
        robots.step_count[w] += 1
        forget_world(contacts, outcome, w)
        plan_world(robots, motion, settings, action, w)
        sort_robots(grid, w, robots.position, robots.present)
        judge_robots(step, contacts, grid, w, settings.horizon)
        judge_walls(step, contacts, walls, w, settings.horizon, squared)
        advance_world(robots, motion, settings, contacts, outcome, w)
        mark_arrivals(robots, settings, outcome, w)
        if settings.after_arrival == REBORN:
            give_birth(robots, settings, outcome, inputs.cooperates, w)
        close_step(robots, settings, outcome, w)

"""The closed loop of robots that know too little: each decides for itself, on stale and wrong measurements.

Step k is due at k dt. Each robot takes it late by up to the clock jitter, on positions that are as old as delay and
lost messages make them, and wrong; its command executes later still, and not quite as commanded. In between everybody
goes on with the command before. The judge looks at the true ways, at every instant.

Errors are drawn at random within their bounds, or `Adversary` chooses them on the bound: neighbours seem further away,
or to the side, robots are pushed at each other, and steps are as far out of line as may be.

Letters: N robots. m, m/s, rad, s.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np

from safefilter.arrays import BoolArray, FloatArray
from safefilter.closest_approach import Approach, Pairs, closest_approach, pairs_within
from safefilter.decision import Decision
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene, X, Y
from safefilter.testing.passive_robots import passive_velocity
from safefilter.testing.paths import Paths, robots_on_paths, walls_on_paths
from safefilter.testing.policies import Policy
from safefilter.uncertainty import Uncertainty

# Sides of the estimated neighbour, from "further away" round to "to the left" and "to the right".
SIDES = (0.0, 0.0, 0.5 * math.pi, -0.5 * math.pi)


class Errors(Protocol):
    """Chooses errors within bounds."""

    def part(self, rng: np.random.Generator) -> float:
        """A part of a bound, in [0, 1]."""
        ...

    def age(self, rng: np.random.Generator) -> float:
        """A part of the largest age of a measurement, in [0, 1]."""
        ...

    def offset(self, away: FloatArray, rng: np.random.Generator) -> FloatArray:
        """An error of at most unit length, shape (2,): of something that is dangerous to take for further ``away``."""
        ...


@dataclass(frozen=True, slots=True)
class AtRandom:
    """Anything within the bounds."""

    def part(self, rng: np.random.Generator) -> float:
        """See `Errors.part`."""
        return float(rng.uniform())

    def age(self, rng: np.random.Generator) -> float:
        """See `Errors.age`."""
        return float(rng.uniform())

    def offset(self, away: FloatArray, rng: np.random.Generator) -> FloatArray:  # noqa: ARG002
        """See `Errors.offset`."""
        angle, length = rng.uniform(0.0, 2.0 * math.pi), math.sqrt(rng.uniform())
        return length * np.array([math.cos(angle), math.sin(angle)])


@dataclass(frozen=True, slots=True)
class Adversary:
    """On the bounds, and towards a collision.

    Attributes:
        sides: Angles from "further away", in rad, that errors are drawn from.
    """

    sides: tuple[float, ...] = SIDES

    def part(self, rng: np.random.Generator) -> float:
        """See `Errors.part`."""
        return float(rng.integers(0, 2))

    def age(self, rng: np.random.Generator) -> float:  # noqa: ARG002
        """See `Errors.age`: who approaches was further away before."""
        return 1.0

    def offset(self, away: FloatArray, rng: np.random.Generator) -> FloatArray:
        """See `Errors.offset`."""
        side = float(rng.choice(self.sides))
        cosine, sine = math.cos(side), math.sin(side)
        x, y = away.tolist()
        return np.array([cosine * x - sine * y, sine * x + cosine * y])


@dataclass(frozen=True, slots=True, eq=False)
class UncertainTrial:
    """Robots that all run the filter, what drives them, and what is wrong.

    Attributes:
        scene: The start, as it is; with headings if ``omega_max`` is above 0.
        policy: Proposes velocities, from what robots have measured.
        v_max: Top speed of all robots, in m/s.
        actual: What goes wrong, at most.
        errors: Who chooses how much.
        dt: Duration of a step, in s.
        num_steps: Number of steps.
        seed: Seed of errors and policy.
        omega_max: Largest turn rate in rad/s: robots are differential drives then. 0: they take any velocity.
    """

    scene: Scene
    policy: Policy
    v_max: float
    actual: Uncertainty
    errors: Errors
    dt: float = 0.2
    num_steps: int = 20
    seed: int = 0
    omega_max: float = 0.0


class UncertainStep(NamedTuple):
    """What truly happened from when one step was due to when the next was.

    Attributes:
        number: From 0 on.
        position: True centres at its end, shape (N, 2), in m.
        clearance: Least free distance of two robots at any instant, in m; infinite for one robot.
        wall_clearance: The same of a robot and a wall; infinite without walls.
        decisions: What each robot that looks decided, each for itself.
    """

    number: int
    position: FloatArray
    clearance: float
    wall_clearance: float
    decisions: tuple[Decision, ...]


class _Command(NamedTuple):
    """What a robot executes: along a direction, or its heading if that is turning."""

    start: float
    speed: float
    angle: float
    turn_rate: float


@dataclass(slots=True)
class _World:
    """True motion: legs from one change of anybody's command to the next."""

    trial: UncertainTrial
    position: FloatArray
    heading: FloatArray
    now: float = 0.0
    executing: list[_Command] = field(default_factory=list)
    waiting: list[list[_Command]] = field(default_factory=list)
    starts: list[float] = field(default_factory=list)
    legs: list[tuple[float, Paths, FloatArray]] = field(default_factory=list)

    @property
    def is_driving(self) -> BoolArray:
        """Who moves where it heads, shape (N,)."""
        return self.trial.scene.cooperative & (self.trial.omega_max > 0.0)

    def measured(self, robot: int, time: float) -> tuple[FloatArray, float]:
        """Where a robot was, and headed, at a time before now."""
        scene, place = self.trial.scene, bisect.bisect_right(self.starts, time) - 1
        if place < 0:
            heading = 0.0 if scene.heading is None else float(scene.heading[robot])
            return scene.position[robot], heading
        start, (end, paths, headings) = self.starts[place], self.legs[place]
        part = min(1.0, (time - start) / (end - start))
        where = paths.at(np.array([robot]), np.array([part]))[0]
        return where, float(headings[robot] + part * paths.turn[robot])

    def velocity(self, robot: int) -> FloatArray:
        """What a robot executes now, shape (2,), in m/s."""
        command = self.executing[robot]
        angle = float(self.heading[robot]) if self.is_driving[robot] else command.angle
        return command.speed * np.array([math.cos(angle), math.sin(angle)])

    def order(self, robot: int, command: _Command) -> None:
        """Let a command wait for its time; it does not overtake those before."""
        waiting = self.waiting[robot]
        before = waiting[-1].start if waiting else 0.0
        waiting.append(command._replace(start=max(command.start, before)))

    def leg(self, until: float) -> Paths:
        """Go on with what everybody executes until a time."""
        duration = until - self.now
        speed = np.array([command.speed for command in self.executing])
        turn = np.array([command.turn_rate for command in self.executing]) * duration
        angle = np.array([command.angle for command in self.executing])
        direction = np.where(self.is_driving, self.heading, angle)
        chord = speed * duration * np.sinc(0.5 * turn / np.pi)
        mean = direction + 0.5 * turn
        moved = np.stack([chord * np.cos(mean), chord * np.sin(mean)], axis=1)
        paths = Paths(self.position, moved, turn)
        self.starts.append(self.now)
        self.legs.append((until, paths, self.heading))
        self.position, self.heading, self.now = self.position + moved, self.heading + turn, until
        return paths

    def legs_until(self, until: float) -> Iterator[Paths]:
        """Go on until a time, and change commands on the way."""
        while self.now < until:
            for robot, waiting in enumerate(self.waiting):
                while waiting and waiting[0].start <= self.now:
                    self.executing[robot] = waiting.pop(0)
            nexts = [waiting[0].start for waiting in self.waiting if waiting]
            yield self.leg(min([until, *nexts]))


def roll_out_uncertain(
    safety_filter: SafetyFilter, trial: UncertainTrial
) -> Iterator[UncertainStep]:
    """Drive the robots, each by what it has measured.

    Args:
        safety_filter: Every robot's.
        trial: Robots, policy, errors.

    Yields:
        Each step after it was made.
    """
    scene, rng = trial.scene, np.random.default_rng(trial.seed)
    size = scene.num_robots
    heading = np.zeros(size) if scene.heading is None else scene.heading.copy()
    world = _World(trial, scene.position.copy(), heading)
    world.executing = [_Command(0.0, 0.0, 0.0, 0.0)] * size
    world.waiting = [[] for _ in range(size)]
    all_pairs = pairs_within(scene.world)
    judged = scene.cooperative[all_pairs.first] | scene.cooperative[all_pairs.second]
    pairs = Pairs(all_pairs.first[judged], all_pairs.second[judged])
    robots = np.flatnonzero(scene.cooperative)
    walls = scene.walls[:, :4].reshape(-1, 2, 2)
    wall_pairs = Pairs(np.repeat(robots, len(walls)), np.tile(np.arange(len(walls)), len(robots)))
    for number in range(trial.num_steps):
        due, decisions = number * trial.dt, []
        _order_passive(world, all_pairs)
        for robot in robots.tolist():
            command, decision = _decided(safety_filter, world, robot, rng)
            decisions.append(decision)
            late = trial.actual.lateness * trial.errors.part(rng)
            world.order(robot, command._replace(start=due + late))
        clearance, wall_clearance = math.inf, math.inf
        for paths in world.legs_until(due + trial.dt):
            near = _judged(trial, paths, pairs)
            clearance = min(clearance, float(near.least.min(initial=np.inf)))
            wall = walls_on_paths(paths, scene.radius, walls, wall_pairs)
            wall_clearance = min(wall_clearance, float(wall.least.min(initial=np.inf)))
        yield UncertainStep(number, world.position, clearance, wall_clearance, tuple(decisions))


def _judged(trial: UncertainTrial, paths: Paths, pairs: Pairs) -> Approach:
    if trial.omega_max > 0.0:
        return robots_on_paths(paths, trial.scene.radius, pairs)
    return closest_approach(paths.start, paths.displacement, trial.scene.radius, pairs)


def _order_passive(world: _World, pairs: Pairs) -> None:
    """Robots that do not cooperate go on as at the start, but do not run into robots that stand."""
    scene = world.trial.scene
    if scene.cooperative.all():
        return
    state = scene.state.copy()
    state[:, X : Y + 1] = world.position
    now = replace(scene, state=state)
    velocity = passive_velocity(now, scene.velocity, pairs, world.trial.dt, passive_speed=math.inf)
    for robot in np.flatnonzero(~scene.cooperative).tolist():
        x, y = velocity[robot].tolist()
        world.order(robot, _Command(world.now, math.hypot(x, y), math.atan2(y, x), 0.0))


def _decided(
    safety_filter: SafetyFilter, world: _World, robot: int, rng: np.random.Generator
) -> tuple[_Command, Decision]:
    """What a robot executes for what it decides on what it has measured, and the decision."""
    trial = world.trial
    seen, towards = _measured_scene(world, robot, rng)
    wanted = trial.policy.act(seen, np.full(seen.num_robots, trial.v_max), rng)[robot]
    part, errors = trial.actual.actuation_error, trial.errors
    if trial.omega_max == 0.0:
        decision = safety_filter.decide(seen, wanted[None], [robot])
        x, y = decision.action[0]
        off = part * math.hypot(x, y) * errors.offset(towards, rng)
        angle = math.atan2(y + off[1], x + off[0])
        return _Command(0.0, math.hypot(x + off[0], y + off[1]), angle, 0.0), decision
    angle = math.atan2(wanted[1], wanted[0]) - _heading_of(seen, robot)
    turn = math.remainder(angle, 2.0 * math.pi) / trial.dt
    turn_rate = min(trial.omega_max, max(-trial.omega_max, turn))
    asked = np.array([[math.hypot(*wanted), turn_rate]])
    decision = safety_filter.decide(seen, asked, [robot])
    speed, turn_rate = decision.action[0]
    # Either counts as that part of the way: the speed, or the turn rate over the longest step.
    share = part * (2.0 * errors.part(rng) - 1.0)
    if rng.integers(2):
        return _Command(0.0, speed * (1.0 + share), 0.0, turn_rate), decision
    longest = trial.dt + trial.actual.lateness
    return _Command(0.0, speed, 0.0, turn_rate + 2.0 * share / longest), decision


def _measured_scene(
    world: _World, robot: int, rng: np.random.Generator
) -> tuple[Scene, FloatArray]:
    """What a robot knows of everybody, and the true direction to its nearest neighbour."""
    trial = world.trial
    scene, actual, errors = trial.scene, trial.actual, trial.errors
    oldest = actual.observation_delay + actual.lost_messages * trial.dt
    position, velocity, heading = scene.position.copy(), scene.velocity.copy(), world.heading.copy()
    offset = world.position - world.position[robot]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    unit = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    gap = np.where(np.arange(len(distance)) == robot, np.inf, distance - scene.radius)
    nearest = unit[int(np.argmin(gap))]
    for other in range(scene.num_robots):
        away = -nearest if other == robot else unit[other]
        time = world.now - oldest * errors.age(rng)
        position[other], heading[other] = world.measured(other, time)
        position[other] += actual.position_error * errors.offset(away, rng)
        heading[other] += actual.heading_error * (2.0 * errors.part(rng) - 1.0)
        if scene.cooperative[other]:
            velocity[other] = world.velocity(other)
        velocity[other] += actual.velocity_error * errors.offset(away, rng)
    seen = Scene.from_world(
        position,
        velocity,
        scene.radius,
        heading=None if scene.heading is None else heading,
        priority=scene.priority,
        cooperative=scene.cooperative,
        walls=scene.walls[:, :4].reshape(-1, 2, 2) if len(scene.walls) > 0 else None,
    )
    return seen, nearest


def _heading_of(scene: Scene, robot: int) -> float:
    return 0.0 if scene.heading is None else float(scene.heading[robot])

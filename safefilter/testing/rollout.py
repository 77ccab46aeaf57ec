"""The closed loop: policies propose, a filter decides, robots move, an independent judge looks on.

Robots that cooperate execute what the filter decides: velocities, or the commands (v, w) of a differential drive. Those
that do not move as `passive_velocity` says: by what the guarantee credits them with, and no more.

Letters: N robots, P pairs, S walls, d dimensions. m, m/s, rad, s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import (
    BoolArray,
    FloatArray,
    frozen,
    per_robot,
    positive_number,
    require_positive,
)
from safefilter.closest_approach import Approach, Pairs, closest_approach, pairs_within
from safefilter.decision import Decision
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.passive_robots import passive_velocity
from safefilter.testing.paths import Paths, robots_on_paths, walls_on_paths
from safefilter.testing.policies import Policy

if TYPE_CHECKING:
    from hypothesis.vendor.pretty import RepresentationPrinter

# Wishes beyond this, in m/s, are nobody's.
SENSIBLE_SPEED = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Robots, what drives them, and for how long. Its ``repr`` is the code that makes it.

    Attributes:
        scene: The start; walls are those that everybody knows.
        policy: Proposes velocities.
        v_max: Top speed of each robot, shape (N,), in m/s.
        dt: Duration of a step, in s.
        num_steps: Number of steps.
        seed: Seed of the policy.
        is_single: Are actions float32? float64 otherwise.
        passive_speed: Stated bound on the speed of robots that do not cooperate, in m/s, as `Separation` knows it.
        omega_max: Largest turn rate in rad/s: robots that cooperate are differential drives then, and actions are
            commands (v, w). 0: robots take any velocity.
    """

    scene: Scene
    policy: Policy
    v_max: FloatArray
    dt: float = 0.2
    num_steps: int = 20
    seed: int = 0
    is_single: bool = False
    passive_speed: float = 0.0
    omega_max: float = 0.0

    def __post_init__(self) -> None:
        """Check and spread the numbers.

        Raises:
            InvalidInput: If a number cannot be used, a robot has walls of its own, or a drive no heading.
            OutOfRange: If a step allows half a turn.
        """
        v_max = require_positive(per_robot(self.v_max, "v_max", self.scene.num_robots), "v_max")
        object.__setattr__(self, "v_max", frozen(v_max))
        positive_number(self.dt, "dt")
        if self.num_steps < 1:
            raise InvalidInput(f"num_steps: expected at least 1, got {self.num_steps}")
        if not 0.0 <= self.omega_max * self.dt < np.pi:
            raise OutOfRange(
                f"omega_max: expected from 0 up, and less than half a turn in a step, got {self.omega_max} rad/s"
            )
        if self.is_driving and self.scene.heading is None:
            raise InvalidInput("scene: differential drives need heading=")
        if len(self.scene.walls) > self.scene.num_shared_walls:
            raise InvalidInput(
                "scene: the judge of this closed loop knows walls= and polygons= only; leave own_walls and lidar out"
            )

    @property
    def is_driving(self) -> bool:
        """Are robots differential drives?"""
        return self.omega_max > 0.0

    def _repr_pretty_(self, printer: RepresentationPrinter, _cycle: bool) -> None:
        """Hypothesis and IPython print dataclasses field by field unless this says otherwise."""
        printer.text(repr(self))

    def __repr__(self) -> str:
        """Write the code that makes it."""
        turning = f", omega_max={self.omega_max!r}" if self.is_driving else ""
        return (
            f"Trial({self.scene!r}, {self.policy!r}, np.array({self.v_max.tolist()!r}), dt={self.dt!r}, "
            f"num_steps={self.num_steps}, seed={self.seed}, is_single={self.is_single}, "
            f"passive_speed={self.passive_speed!r}{turning})"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One step of the closed loop.

    Attributes:
        number: From 0 on.
        scene: What everyone knew at its start, wanted velocities included.
        action: What the policy asked for, velocities or commands, shape (N, d), float32 or float64.
        decision: What the filter decided, for the robots that cooperate; None without a filter.
        velocity: What executed, shape (N, d), in m/s: for a drive the displacement by dt.
        turn: Angles turned on the way, shape (N,), in rad.
        pairs: Pairs judged: all but those of two robots that do not cooperate.
        approach: How near they came.
        wall_pairs: Robots that cooperate, and the walls, all with all.
        wall_approach: How near they came.
    """

    number: int
    scene: Scene
    action: npt.NDArray[np.floating]
    decision: Decision | None
    velocity: FloatArray
    turn: FloatArray
    pairs: Pairs
    approach: Approach
    wall_pairs: Pairs
    wall_approach: Approach


class _Executed(NamedTuple):
    """Mean velocities and turns of a step."""

    velocity: FloatArray
    turn: FloatArray


class _Judge:
    """Who is judged against what; that stays through a trial."""

    def __init__(self, trial: Trial) -> None:
        scene = trial.scene
        self.all_pairs = pairs_within(scene.world)
        first, second = self.all_pairs
        judged = scene.cooperative[first] | scene.cooperative[second]
        self.pairs = Pairs(first[judged], second[judged])
        self.walls = scene.walls[:, :4].reshape(-1, 2, 2)
        robots = np.flatnonzero(scene.cooperative)
        self.wall_pairs = Pairs(
            np.repeat(robots, len(self.walls)), np.tile(np.arange(len(self.walls)), len(robots))
        )

    def look(self, scene: Scene, executed: _Executed, dt: float) -> tuple[Approach, Approach]:
        displacement = executed.velocity * dt
        if len(self.wall_pairs.first) == 0 and not executed.turn.any():
            approach = closest_approach(scene.position, displacement, scene.radius, self.pairs)
            return approach, Approach(*np.empty((3, 0)))
        paths = Paths(scene.position, displacement, executed.turn)
        if executed.turn.any():
            approach = robots_on_paths(paths, scene.radius, self.pairs)
        else:
            approach = closest_approach(scene.position, displacement, scene.radius, self.pairs)
        return approach, walls_on_paths(paths, scene.radius, self.walls, self.wall_pairs)


def roll_out(safety_filter: SafetyFilter | None, trial: Trial) -> Iterator[Step]:
    """Drive the robots, step by step.

    Args:
        safety_filter: Decides for the robots that cooperate. None executes what the policy asks for, cut to the top
            speed.
        trial: Robots, policy and duration.

    Yields:
        Each step after it was made.
    """
    scene, rng, judge = trial.scene, np.random.default_rng(trial.seed), _Judge(trial)
    for number in range(trial.num_steps):
        asked = trial.policy.act(scene, trial.v_max, rng)
        action: npt.NDArray[np.floating] = _action(trial, scene, asked)
        action = action.astype(np.float32 if trial.is_single else np.float64)
        # What makes no sense is nothing that others could know of.
        makes_sense = (np.abs(asked) <= SENSIBLE_SPEED).all(axis=1, keepdims=True)
        finite = np.where(makes_sense, asked, 0.0)
        wanted = finite if trial.is_driving else finite.astype(action.dtype).astype(np.float64)
        scene = _with_wanted(scene, wanted)
        decision, executed = None, action.astype(np.float64)
        decided = scene.cooperative & (safety_filter is not None)
        if safety_filter is not None and decided.any():
            decision = safety_filter.decide(scene, action[decided])
            executed[decided] = decision.action
        moved = _moved_by(trial, scene, executed, decided)
        passive = passive_velocity(scene, wanted, judge.all_pairs, trial.dt, trial.passive_speed)
        moved.velocity[~scene.cooperative] = passive[~scene.cooperative]
        moved.turn[~scene.cooperative] = 0.0
        approach, wall_approach = judge.look(scene, moved, trial.dt)
        yield Step(
            number,
            scene,
            action,
            decision,
            *moved,
            judge.pairs,
            approach,
            judge.wall_pairs,
            wall_approach,
        )
        # A robot that does not cooperate is seen to move as it wanted to, whatever it then does.
        seen = np.where(scene.cooperative[:, None], moved.velocity, wanted)
        scene = _after(scene, scene.position + moved.velocity * trial.dt, seen, moved.turn)


def _action(trial: Trial, scene: Scene, asked: FloatArray) -> FloatArray:
    """What the policy's velocities are as actions: themselves, or commands that turn towards them at their speed."""
    if not trial.is_driving or scene.heading is None:
        return asked
    # Infinities have no direction.
    with np.errstate(invalid="ignore"):
        angle = np.arctan2(asked[:, 1], asked[:, 0]) - scene.heading
    turn = (angle + np.pi) % (2.0 * np.pi) - np.pi
    turn_rate = np.clip(turn / trial.dt, -trial.omega_max, trial.omega_max)
    return np.stack([np.hypot(asked[:, 0], asked[:, 1]), turn_rate], axis=1)


def _moved_by(trial: Trial, scene: Scene, action: FloatArray, decided: BoolArray) -> _Executed:
    """How robots move by actions; those that the filter did not decide are cut to what robots can do."""
    # Who asks for nothing that is a number stands still; what the filter answers is executed as it is.
    makes_sense = decided | np.isfinite(action).all(axis=1)
    action = np.where(makes_sense[:, None], action, 0.0)
    if not trial.is_driving or scene.heading is None:
        velocity = np.where(decided[:, None], action, _within_speed(action, trial.v_max))
        return _Executed(velocity, np.zeros(scene.num_robots))
    speed, turn = action[:, 0], action[:, 1] * trial.dt
    speed = np.where(decided, speed, np.minimum(speed, trial.v_max))
    # The chord of an arc is as much shorter as sin(x) is than x, at half of the turn.
    chord, angle = speed * np.sinc(0.5 * turn / np.pi), scene.heading + 0.5 * turn
    return _Executed(np.stack([chord * np.cos(angle), chord * np.sin(angle)], axis=1), turn)


def _within_speed(velocity: FloatArray, v_max: FloatArray) -> FloatArray:
    speed: FloatArray = np.hypot.reduce(velocity, axis=1)
    excess = np.maximum(speed / v_max, 1.0)
    return velocity / excess[:, None]


def _with_wanted(scene: Scene, wanted: FloatArray) -> Scene:
    """The same scene, with wanted velocities; neighbours stay as they are."""
    state = scene.state.copy()
    state[:, 2 * scene.dimension : 3 * scene.dimension] = wanted
    return replace(scene, state=frozen(state), has_wanted=True)


def _after(scene: Scene, position: FloatArray, velocity: FloatArray, turn: FloatArray) -> Scene:
    return Scene.from_world(
        position,
        velocity,
        scene.radius,
        heading=None if scene.heading is None else scene.heading + turn,
        priority=scene.priority,
        cooperative=scene.cooperative,
        world=scene.world,
        reach=scene.reach if np.isfinite(scene.reach) else None,
        walls=scene.walls[:, :4].reshape(-1, 2, 2) if len(scene.walls) > 0 else None,
    )

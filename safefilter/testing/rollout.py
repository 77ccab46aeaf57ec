"""The closed loop: policies propose, a filter decides, robots move, an independent judge looks on.

Robots that cooperate execute what the filter decides. Those that do not move as `passive_velocity` says: by what the
guarantee credits them with, and no more.

Letters: N robots, P pairs. m, m/s, s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, frozen, per_robot, positive_number, require_positive
from safefilter.closest_approach import Approach, Pairs, closest_approach, pairs_within
from safefilter.decision import Decision
from safefilter.errors import InvalidInput
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import WANTED_X, WANTED_Y, Scene
from safefilter.testing.policies import Policy
from safefilter.testing.reproduction import scene_code

if TYPE_CHECKING:
    from hypothesis.vendor.pretty import RepresentationPrinter


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Robots, what drives them, and for how long. Its ``repr`` is the code that makes it.

    Attributes:
        scene: The start, without walls.
        policy: Proposes velocities.
        v_max: Top speed of each robot, shape (N,), in m/s.
        dt: Duration of a step, in s.
        num_steps: Number of steps.
        seed: Seed of the policy.
        is_single: Are actions float32? float64 otherwise.
        passive_speed: Stated bound on the speed of robots that do not cooperate, in m/s, as `Separation` knows it.
    """

    scene: Scene
    policy: Policy
    v_max: FloatArray
    dt: float = 0.2
    num_steps: int = 20
    seed: int = 0
    is_single: bool = False
    passive_speed: float = 0.0

    def __post_init__(self) -> None:
        """Check and spread the numbers.

        Raises:
            InvalidInput: If a number cannot be used.
        """
        v_max = require_positive(per_robot(self.v_max, "v_max", self.scene.num_robots), "v_max")
        object.__setattr__(self, "v_max", frozen(v_max))
        positive_number(self.dt, "dt")
        if self.num_steps < 1:
            raise InvalidInput(f"num_steps: expected at least 1, got {self.num_steps}")
        if len(self.scene.walls) > 0:
            raise InvalidInput(
                "scene: the judge of this closed loop knows robots only; leave walls out"
            )

    def _repr_pretty_(self, printer: RepresentationPrinter, _cycle: bool) -> None:
        """Hypothesis and IPython print dataclasses field by field unless this says otherwise."""
        printer.text(repr(self))

    def __repr__(self) -> str:
        """Write the code that makes it."""
        return (
            f"Trial({scene_code(self.scene)}, {self.policy!r}, np.array({self.v_max.tolist()!r}), dt={self.dt!r}, "
            f"num_steps={self.num_steps}, seed={self.seed}, is_single={self.is_single}, "
            f"passive_speed={self.passive_speed!r})"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One step of the closed loop.

    Attributes:
        number: From 0 on.
        scene: What everyone knew at its start, wanted velocities included.
        action: What the policy asked for, shape (N, 2), in m/s, float32 or float64.
        decision: What the filter decided, for the robots that cooperate; None without a filter.
        velocity: What executed, shape (N, 2), in m/s.
        pairs: Pairs judged: all but those of two robots that do not cooperate.
        approach: How near they came.
    """

    number: int
    scene: Scene
    action: npt.NDArray[np.floating]
    decision: Decision | None
    velocity: FloatArray
    pairs: Pairs
    approach: Approach


def closed_loop(safety_filter: SafetyFilter | None, trial: Trial) -> Iterator[Step]:
    """Drive the robots, step by step.

    Args:
        safety_filter: Decides for the robots that cooperate. None executes what the policy asks for, cut to the top
            speed.
        trial: Robots, policy and duration.

    Yields:
        Each step after it was made.
    """
    scene, rng = trial.scene, np.random.default_rng(trial.seed)
    world_pairs = pairs_within(scene.world)
    judged = scene.cooperative[world_pairs.first] | scene.cooperative[world_pairs.second]
    pairs = Pairs(world_pairs.first[judged], world_pairs.second[judged])
    dtype = np.dtype(np.float32 if trial.is_single else np.float64)
    for number in range(trial.num_steps):
        action = trial.policy.act(scene, trial.v_max, rng).astype(dtype)
        wanted = action.astype(np.float64)
        scene = _with_wanted(scene, wanted)
        decision, velocity = None, _within_speed(wanted, trial.v_max)
        if safety_filter is not None and scene.cooperative.any():
            decision = safety_filter.decide(scene, action[scene.cooperative])
            velocity[scene.cooperative] = decision.action
        passive = passive_velocity(scene, wanted, world_pairs, trial.dt, trial.passive_speed)
        velocity[~scene.cooperative] = passive[~scene.cooperative]
        displacement = velocity * trial.dt
        approach = closest_approach(scene.position, displacement, scene.radius, pairs)
        yield Step(number, scene, action, decision, velocity, pairs, approach)
        # A robot that does not cooperate is seen to move as it wanted to, whatever it then does.
        seen = np.where(scene.cooperative[:, None], velocity, wanted)
        scene = _moved(scene, scene.position + displacement, seen)


def passive_velocity(
    scene: Scene, wanted: FloatArray, pairs: Pairs, dt: float, passive_speed: float
) -> FloatArray:
    """Velocities of robots that do not cooperate, as fast as the guarantee lets them be.

    Towards each cooperating robot they advance in the step by no more than the approach that their observed velocity
    (or the stated bound on their speed) is credited with, and no further than contact. Either the wanted velocity or
    the observed one, cut to that; the faster of the two.

    Args:
        scene: Observed velocities and positions.
        wanted: Velocities wanted, shape (N, 2), in m/s.
        pairs: All pairs that share a world.
        dt: Duration of the step, in s.
        passive_speed: Stated bound on their speed, in m/s.

    Returns:
        Shape (N, 2), in m/s; rows of cooperating robots mean nothing.
    """
    robot = np.concatenate([pairs.first, pairs.second])
    other = np.concatenate([pairs.second, pairs.first])
    counts = ~scene.cooperative[robot] & scene.cooperative[other]
    robot, other = robot[counts], other[counts]
    offset = scene.position[other] - scene.position[robot]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    towards = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    gap = np.maximum(0.0, distance - scene.radius[robot] - scene.radius[other])
    seen = np.einsum("pk,pk->p", towards, scene.velocity[robot])
    bound = np.minimum(np.maximum(seen, passive_speed) * dt, gap)
    candidates = []
    for velocity in (wanted, scene.velocity):
        advance = np.einsum("pk,pk->p", towards, velocity[robot]) * dt
        part = np.divide(bound, advance, out=np.ones_like(bound), where=advance > bound)
        scale = np.ones(scene.num_robots)
        np.minimum.at(scale, robot, part)
        candidates.append(velocity * scale[:, None])
    first, second = candidates
    is_faster = (first**2).sum(axis=1) >= (second**2).sum(axis=1)
    return np.where(is_faster[:, None], first, second)


def _within_speed(velocity: FloatArray, v_max: FloatArray) -> FloatArray:
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    excess = np.maximum(speed / v_max, 1.0)
    return velocity / excess[:, None]


def _with_wanted(scene: Scene, wanted: FloatArray) -> Scene:
    """The same scene, with wanted velocities; neighbours stay as they are."""
    state = scene.state.copy()
    state[:, WANTED_X : WANTED_Y + 1] = wanted
    return replace(scene, state=frozen(state), has_wanted=True)


def _moved(scene: Scene, position: FloatArray, velocity: FloatArray) -> Scene:
    return Scene.from_world(
        position,
        velocity,
        scene.radius,
        heading=scene.heading,
        priority=scene.priority,
        cooperative=scene.cooperative,
        world=scene.world,
        reach=scene.reach if np.isfinite(scene.reach) else None,
    )

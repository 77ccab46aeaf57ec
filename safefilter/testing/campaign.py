"""Long runs over random crowds: every policy, ``v_opt`` and dtype in turn, the other options by chance.

m, m/s, s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from safefilter.constraints.constraint import Constraint
from safefilter.constraints.priority_orca import Leg, PriorityORCA, SlackRule, VOpt
from safefilter.constraints.separation import Separation
from safefilter.kinematics.holonomic import Holonomic
from safefilter.safety_filter import TOLERANCE, SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.crowds import Crowd, random_crowd
from safefilter.testing.policies import (
    GoalSeeking,
    Mixed,
    NotFinite,
    Policy,
    Ramming,
    UniformRandom,
)
from safefilter.testing.rollout import Trial, roll_out
from safefilter.testing.tally import NOTHING, Tally

DT = 0.2
TIME_HORIZON = 2.0
# Numbers without a common divisor, and the dtype changes after a round of policies: 24 trials hold every combination.
POLICIES = ("random", "ramming", "goal-seeking", "mixed")
V_OPTS: tuple[VOpt, ...] = ("current", "shared", "own")
COMBINATIONS = 24
# A stated bound on the speed of robots that do not cooperate, in m/s, for trials that use one.
PASSIVE_SPEED = 0.3
# Large trials make good use of a batch; a small number of robot-steps needs small ones to see every combination.
MOST_ROBOTS, LEAST_ROBOTS = 1000, 10
MOST_STEPS, LEAST_STEPS = 25, 10
LONG_RUN = 100_000
# Solvers that take 79 ms a decision for the accuracy of the others take 6 ms for this one, in m/s; what they find is
# polished, and no guarantee depends on it.
SLOW_BACKENDS = {"qpsolvers:scs": 1e-5, "cvxpy:SCS": 1e-5}


@dataclass(frozen=True, slots=True)
class Setting:
    """One trial, and how its filter is put together.

    Attributes:
        trial: Robots, policy and duration.
        v_opt: Option of `PriorityORCA`.
        slack_rule: Option of `PriorityORCA`.
        leg: Option of `PriorityORCA`.
        right_bias: Option of `SafetyFilter`, in rad.
    """

    trial: Trial
    v_opt: VOpt
    slack_rule: SlackRule
    leg: Leg
    right_bias: float

    def safety_filter(
        self,
        backend: str = "planar",
        *,
        has_separation: bool = True,
        deadline: float | None = None,
    ) -> SafetyFilter:
        """Make the filter; without separation Priority-ORCA is alone.

        Args:
            backend: Who solves.
            has_separation: With `Separation`?
            deadline: Of `SafetyFilter`, in s.
        """
        constraints: list[Constraint] = [
            PriorityORCA(TIME_HORIZON, self.v_opt, self.slack_rule, self.leg)
        ]
        if has_separation:
            constraints.append(Separation(DT, passive_speed=self.trial.passive_speed))
        return SafetyFilter(
            constraints,
            Holonomic(self.trial.v_max, dimension=self.trial.scene.dimension),
            backend=backend,
            deadline=deadline,
            tolerance=SLOW_BACKENDS.get(backend, TOLERANCE),
            right_bias=self.right_bias,
        )


def drive(
    make_filter: Callable[[Setting], SafetyFilter | None],
    robot_steps: int,
    seed: int,
    watch: Callable[[Tally], None] = lambda _: None,
) -> Tally:
    """Drive crowds until a number of robot-steps is made.

    Args:
        make_filter: What decides in a setting, or None for no filter.
        robot_steps: Steps of robots that cooperate, at least.
        seed: Seed of crowds, options and policies: the same ones, whatever the filter.
        watch: Told the totals after each step.
    """
    tally = NOTHING
    for setting in settings(seed, robot_steps):
        for step in roll_out(make_filter(setting), setting.trial):
            tally += Tally.of(step)
            watch(tally)
        if tally.robot_steps >= robot_steps:
            break
    return tally


def settings(seed: int, robot_steps: int) -> Iterator[Setting]:
    """Draw settings without end, of a size such that ``robot_steps`` see every combination."""
    rng = np.random.default_rng(seed)
    num_steps = MOST_STEPS if robot_steps >= LONG_RUN else LEAST_STEPS
    # Worlds come whole, so trials turn out larger than asked for: half the size leaves room for that.
    wished = robot_steps // (2 * COMBINATIONS * num_steps)
    num_robots = min(max(wished, LEAST_ROBOTS), MOST_ROBOTS)
    for number in count():
        yield setting_of(rng, number, random_crowd(rng, num_robots), num_steps, seed + number)


def setting_of(
    rng: np.random.Generator,
    number: int,
    crowd: Crowd,
    num_steps: int,
    seed: int,
    *,
    policies: tuple[str, ...] = POLICIES,
) -> Setting:
    """Draw one setting.

    Args:
        rng: Source of chance.
        number: `COMBINATIONS` of them in a row hold every combination of four policies.
        crowd: The robots.
        num_steps: Number of steps.
        seed: Seed of the policy.
        policies: Names that `policy_of` knows, gone through in turn.
    """
    trial = Trial(
        crowd.scene,
        policy_of(policies[number % len(policies)], crowd.scene),
        crowd.v_max,
        dt=DT,
        num_steps=num_steps,
        seed=seed,
        is_single=bool(number // len(policies) % 2),
        passive_speed=float(rng.choice([0.0, PASSIVE_SPEED])),
    )
    return Setting(
        trial,
        V_OPTS[number % len(V_OPTS)],
        slack_rule="dual" if rng.integers(2) else "paper",
        leg="nearest" if rng.integers(2) else "norm",
        right_bias=float(rng.choice([0.0, 0.05])),
    )


def policy_of(name: str, scene: Scene) -> Policy:
    """Make the policy of a name in `POLICIES`, or "senseless": mixed, and not finite now and then."""
    across = GoalSeeking.across(scene, DT)
    policies: dict[str, Policy] = {
        "random": UniformRandom(),
        "ramming": Ramming(),
        "goal-seeking": across,
        "mixed": Mixed((UniformRandom(), Ramming(), across)),
        "senseless": NotFinite(Mixed((UniformRandom(), Ramming(), across))),
    }
    return policies[name]

"""Drive random crowds until a number of robot-steps is reached, and count what matters.

``python -m safefilter.testing.stress --steps 1e6 --backend planar --seed 0`` prints, for the same crowds and policies:
the filter as it is; the filter without `Separation`, which is Priority-ORCA alone; and no filter at all. Anything but
zero collisions and zero uncertified actions in the first ends with exit code 1.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from safefilter.backends.registry import available_backends
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.priority_orca import PriorityORCA, VOpt
from safefilter.constraints.separation import Separation
from safefilter.decision import Fault
from safefilter.kinematics.holonomic import Holonomic
from safefilter.safety_filter import SafetyFilter
from safefilter.testing.crowds import random_crowd
from safefilter.testing.policies import GoalSeeking, Mixed, Policy, Ramming, UniformRandom
from safefilter.testing.rollout import Trial, closed_loop
from safefilter.testing.tally import NOTHING, Tally

DT = 0.2
TIME_HORIZON = 2.0
STEPS_PER_TRIAL = 25
ROBOTS_PER_TRIAL = 1000
V_OPTS: tuple[VOpt, ...] = ("current", "shared", "own")
POLICIES = ("random", "ramming", "goal-seeking", "mixed")
# A stated bound on the speed of robots that do not cooperate, in m/s, for trials that use one.
PASSIVE_SPEED = 0.3

Watch = Callable[[Tally], None]


@dataclass(frozen=True, slots=True)
class Setting:
    """One trial, and how its filter is put together.

    Attributes:
        trial: Robots, policy and duration.
        v_opt: Option of `PriorityORCA`.
        slack_rule_is_dual: `PriorityORCA`'s ``slack_rule``: "dual", else "paper".
        leg_is_nearest: `PriorityORCA`'s ``leg``: "nearest", else "norm".
        right_bias: Option of `SafetyFilter`, in rad.
    """

    trial: Trial
    v_opt: VOpt
    slack_rule_is_dual: bool
    leg_is_nearest: bool
    right_bias: float

    def safety_filter(self, backend: str, *, has_separation: bool = True) -> SafetyFilter:
        """Make the filter."""
        orca = PriorityORCA(
            TIME_HORIZON,
            self.v_opt,
            "dual" if self.slack_rule_is_dual else "paper",
            "nearest" if self.leg_is_nearest else "norm",
        )
        constraints: list[Constraint] = [orca]
        if has_separation:
            constraints.append(Separation(DT, passive_speed=self.trial.passive_speed))
        return SafetyFilter(
            constraints,
            Holonomic(self.trial.v_max),
            backend=backend,
            right_bias=self.right_bias,
        )


def settings(seed: int, num_robots: int = ROBOTS_PER_TRIAL) -> Iterator[Setting]:
    """Draw settings without end: every policy, ``v_opt`` and dtype in turn, the rest by chance."""
    rng = np.random.default_rng(seed)
    number = 0
    while True:
        crowd = random_crowd(rng, num_robots)
        # The three counters have no common divisor with each other's period but through number itself.
        policy = _policy(POLICIES[number % len(POLICIES)], crowd.scene)
        trial = Trial(
            crowd.scene,
            policy,
            crowd.v_max,
            dt=DT,
            num_steps=STEPS_PER_TRIAL,
            seed=seed + number,
            is_single=bool(number // len(POLICIES) % 2),
            passive_speed=float(rng.choice([0.0, PASSIVE_SPEED])),
        )
        yield Setting(
            trial,
            V_OPTS[number % len(V_OPTS)],
            slack_rule_is_dual=bool(rng.integers(2)),
            leg_is_nearest=bool(rng.integers(2)),
            right_bias=float(rng.choice([0.0, 0.05])),
        )
        number += 1


def filtered(
    backend: str,
    num_steps: int,
    seed: int,
    *,
    num_robots: int = ROBOTS_PER_TRIAL,
    has_separation: bool = True,
    watch: Watch = lambda _: None,
) -> Tally:
    """Drive crowds through a filter until at least ``num_steps`` robot-steps are made.

    Args:
        backend: Who solves.
        num_steps: Robot-steps.
        seed: Seed of crowds and policies.
        num_robots: Robots a trial.
        has_separation: With the hard separation rows? Without, Priority-ORCA is alone.
        watch: Told the totals after each step.
    """
    tally = NOTHING
    for setting in settings(seed, num_robots):
        safety_filter = setting.safety_filter(backend, has_separation=has_separation)
        for step in closed_loop(safety_filter, setting.trial):
            tally += Tally.of(step)
            watch(tally)
            if tally.robot_steps >= num_steps:
                return tally
    return tally


def unfiltered(
    num_steps: int,
    seed: int,
    *,
    num_robots: int = ROBOTS_PER_TRIAL,
    watch: Watch = lambda _: None,
) -> Tally:
    """Drive the same crowds with the same policies and no filter; arguments as in `filtered`."""
    tally = NOTHING
    for setting in settings(seed, num_robots):
        for step in closed_loop(None, setting.trial):
            tally += Tally.of(step)
            watch(tally)
            if tally.robot_steps >= num_steps:
                return tally
    return tally


def _policy(name: str, scene: Scene) -> Policy:
    across = GoalSeeking.across(scene, DT)
    return {
        "random": UniformRandom(),
        "ramming": Ramming(),
        "goal-seeking": across,
        "mixed": Mixed((UniformRandom(), Ramming(), across)),
    }[name]


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m safefilter.testing.stress", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--steps", type=float, default=1e6, help="robot-steps (default: 1e6)")
    parser.add_argument("--backend", default="planar", help="who solves (default: planar), or 'all'")
    parser.add_argument("--seed", type=int, default=0, help="seed of crowds and policies (default: 0)")
    parser.add_argument("--robots", type=int, default=ROBOTS_PER_TRIAL, help="robots a trial")
    options = parser.parse_args(arguments)
    backends = available_backends() if options.backend == "all" else (options.backend,)
    num_steps = int(options.steps)
    table = Table()
    is_safe = True
    for backend in backends:
        tally = table.row(
            f"filter on, {backend}",
            num_steps,
            lambda watch, backend=backend: filtered(
                backend, num_steps, options.seed, num_robots=options.robots, watch=watch
            ),
        )
        is_safe = is_safe and tally.collisions == 0 and tally.uncertified == 0
    table.row(
        "separation off, planar",
        num_steps,
        lambda watch: filtered(
            "planar",
            num_steps,
            options.seed,
            num_robots=options.robots,
            has_separation=False,
            watch=watch,
        ),
    )
    table.row(
        "filter off",
        num_steps,
        lambda watch: unfiltered(num_steps, options.seed, num_robots=options.robots, watch=watch),
    )
    return 0 if is_safe else 1

"""What the demo compares: every policy with equal and mixed priorities, filter off and on, over the crossroad."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from envs import Crossroad, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED
from policies.policy import Policy
from policies.ramming import Ramming
from policies.rollout import Rollout, roll_out
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Separation

POLICIES: tuple[Policy, ...] = (StraightToGoal(), UniformRandom(), Ramming())
# Two robots an arm, one of them more important; left and right in turn.
PRIORITIES = {"equal": (1.0,) * 8, "mixed": (1.0, 8.0, 2.0, 4.0, 8.0, 1.0, 4.0, 2.0)}
FILTERS = ("off", "on")
RULES = Rules()


@dataclass(frozen=True, slots=True)
class Trial:
    """One line of the table.

    Attributes:
        policy: Drives all robots.
        priorities: Key of `PRIORITIES`.
        filtering: One of `FILTERS`.
    """

    policy: Policy
    priorities: str
    filtering: str

    @property
    def is_filtered(self) -> bool:
        """Is the filter on?"""
        return self.filtering == "on"


def all_trials() -> Iterator[Trial]:
    """All combinations, those to be compared one after the other."""
    for policy in POLICIES:
        for priorities in PRIORITIES:
            for filtering in FILTERS:
                yield Trial(policy, priorities, filtering)


def make_filter() -> SafetyFilter:
    """The filter of all trials."""
    return SafetyFilter(
        [PriorityORCA(time_horizon=2.0), Separation(dt=RULES.dt)], Holonomic(v_max=MAX_SPEED)
    )


def run_trial(
    trial: Trial, safety_filter: SafetyFilter, *, seed: int, max_steps: int, num_worlds: int
) -> Rollout:
    """Drive one trial.

    Args:
        trial: What to drive.
        safety_filter: Used where the trial has its filter on.
        seed: Seed of starts and policies.
        max_steps: Steps at most.
        num_worlds: Worlds driven at once.
    """
    scenario = Crossroad()
    fleet = Fleet.of(
        scenario.num_robots,
        priority=PRIORITIES[trial.priorities],
        cooperative=trial.is_filtered,
    )
    return roll_out(
        Navigation(scenario, fleet, RULES, num_worlds=num_worlds),
        trial.policy,
        safety_filter if trial.is_filtered else None,
        seed=seed,
        max_steps=max_steps,
    )

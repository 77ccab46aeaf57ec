"""What the demo compares: every policy with equal and mixed priorities, filter off and on, over the crossroad."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from envs import Crossroad, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED, MAX_TURN_RATE
from policies.policy import Policy
from policies.ramming import Ramming
from policies.rollout import Rollout, roll_out
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom
from safefilter import DifferentialDrive, PriorityORCA, SafetyFilter, Separation, StaticObstacles
from safefilter.arrays import FloatArray
from safefilter.decision import Decision
from safefilter.scene import Scene

POLICIES: tuple[Policy, ...] = (StraightToGoal(), UniformRandom(), Ramming())
# Two robots an arm, one of them more important; left and right in turn.
PRIORITIES = {"equal": (1.0,) * 8, "mixed": (1.0, 8.0, 2.0, 4.0, 8.0, 1.0, 4.0, 2.0)}
FILTERS = ("off", "on")
RULES = Rules()
SCENARIO = Crossroad(is_walled=True)
TIME_HORIZON = 2.0  # s
WALL_HORIZON = 1.0  # s
TRACKING_ERROR = 0.02  # m


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
        [
            PriorityORCA(time_horizon=TIME_HORIZON),
            Separation(dt=RULES.dt),
            StaticObstacles(time_horizon=WALL_HORIZON),
        ],
        DifferentialDrive(MAX_SPEED, MAX_TURN_RATE, RULES.dt, tracking_error=TRACKING_ERROR),
    )


def run_trial(
    trial: Trial,
    safety_filter: SafetyFilter,
    *,
    seed: int,
    max_steps: int,
    num_worlds: int,
    watch: Callable[[Scene, FloatArray, Decision], None] = lambda *_: None,
) -> Rollout:
    """Drive one trial.

    Args:
        trial: What to drive.
        safety_filter: Used where the trial has its filter on.
        seed: Seed of starts and policies.
        max_steps: Steps at most.
        num_worlds: Worlds driven at once.
        watch: Told of every decision, see `roll_out`.
    """
    fleet = Fleet.of(
        SCENARIO.num_robots,
        priority=PRIORITIES[trial.priorities],
        cooperative=trial.is_filtered,
        kinematics="differential",
    )
    return roll_out(
        Navigation(SCENARIO, fleet, RULES, num_worlds=num_worlds),
        trial.policy,
        safety_filter if trial.is_filtered else None,
        seed=seed,
        max_steps=max_steps,
        watch=watch,
    )

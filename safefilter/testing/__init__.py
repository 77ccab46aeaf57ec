"""Property-based tests for whatever uses the filter: strategies, invariants, closed loops, faults, a backend contract.

Needs the extra ``testing``. That your environment with your filter in it is safe, whatever the policy asks for::

    TestMyRobots = closed_loop(make_env, lambda env: SafeAction(env, safety_filter)).TestCase

That your settings keep your robots apart, from contact at the start on::

    @given(rollouts(touching(), dt=0.1))
    def test_robots_never_touch(trial: Trial) -> None:
        separation = Separation(0.1, passive_speed=trial.passive_speed)
        safety_filter = SafetyFilter([PriorityORCA(2.0), separation], Holonomic(trial.v_max))
        assert_collision_free(safety_filter, trial)
"""

from __future__ import annotations

from safefilter.closest_approach import CONTACT_TOLERANCE, closest_approach, pairs_within
from safefilter.testing.agreement import BackendsDisagree, assert_backends_agree
from safefilter.testing.backend_contract import (
    BACKEND_CHECKS,
    CONTRACT_TOLERANCE,
    ContractBroken,
    backend_contract,
)
from safefilter.testing.closed_loop import ClosedLoop, closed_loop
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS
from safefilter.testing.invariants import (
    Collision,
    NotCertified,
    WrongAllocation,
    assert_certified,
    assert_collision_free,
    assert_priority_allocation,
)
from safefilter.testing.minimality import NotMinimal, assert_minimal
from safefilter.testing.policies import (
    GoalSeeking,
    Mixed,
    NotFinite,
    Policy,
    Ramming,
    UniformRandom,
)
from safefilter.testing.program_strategies import programs
from safefilter.testing.rollout import Step, Trial, roll_out
from safefilter.testing.smallest_change import WrongChange, assert_smallest_change
from safefilter.testing.strategies import (
    actions,
    adversarial_policies,
    crowded,
    degenerate,
    head_on,
    priorities,
    radii,
    rollouts,
    scenes,
    speeds,
    symmetric,
    touching,
    velocities,
)
from safefilter.testing.tally import Tally
from safefilter.testing.tracked_velocities import NotTracked, assert_tracked
from safefilter.testing.uncertain_loop import (
    Adversary,
    AtRandom,
    UncertainStep,
    UncertainTrial,
    roll_out_uncertain,
)
from safefilter.testing.wall_strategies import walls

__all__ = [
    "BACKEND_CHECKS",
    "CONTACT_TOLERANCE",
    "CONTRACT_TOLERANCE",
    "FAULTS",
    "FAULTS_IN_A_PROCESS",
    "Adversary",
    "AtRandom",
    "BackendsDisagree",
    "ClosedLoop",
    "Collision",
    "ContractBroken",
    "GoalSeeking",
    "Mixed",
    "NotCertified",
    "NotFinite",
    "NotMinimal",
    "NotTracked",
    "Policy",
    "Ramming",
    "Step",
    "Tally",
    "Trial",
    "UncertainStep",
    "UncertainTrial",
    "UniformRandom",
    "WrongAllocation",
    "WrongChange",
    "actions",
    "adversarial_policies",
    "assert_backends_agree",
    "assert_certified",
    "assert_collision_free",
    "assert_minimal",
    "assert_priority_allocation",
    "assert_smallest_change",
    "assert_tracked",
    "backend_contract",
    "closed_loop",
    "closest_approach",
    "crowded",
    "degenerate",
    "head_on",
    "pairs_within",
    "priorities",
    "programs",
    "radii",
    "roll_out",
    "roll_out_uncertain",
    "rollouts",
    "scenes",
    "speeds",
    "symmetric",
    "touching",
    "velocities",
    "walls",
]

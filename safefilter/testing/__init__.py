"""Property-based tests for whatever uses the filter: strategies, invariants, a closed loop, faults, a backend contract.

Needs the extra ``testing``. For example, that your settings keep your robots apart::

    @given(trials(touching(), dt=0.1))
    def test_robots_never_touch(trial: Trial) -> None:
        safety_filter = SafetyFilter([PriorityORCA(2.0), Separation(0.1)], Holonomic(trial.v_max))
        assert_collision_free(safety_filter, trial)
"""

from __future__ import annotations

from safefilter.closest_approach import CONTACT_TOLERANCE, closest_approach, pairs_within
from safefilter.testing.backend_contract import (
    BACKEND_CHECKS,
    CONTRACT_TOLERANCE,
    ContractBroken,
    backend_contract,
)
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS
from safefilter.testing.invariants import (
    Collision,
    NotCertified,
    WrongAllocation,
    assert_certified,
    assert_collision_free,
    assert_priority_allocation,
)
from safefilter.testing.policies import GoalSeeking, Mixed, Policy, Ramming, UniformRandom
from safefilter.testing.rollout import Step, Trial, closed_loop
from safefilter.testing.strategies import (
    actions,
    crowded,
    head_on,
    policies,
    priorities,
    radii,
    scenes,
    speeds,
    symmetric,
    touching,
    trials,
    velocities,
)
from safefilter.testing.tally import Tally

__all__ = [
    "BACKEND_CHECKS",
    "CONTACT_TOLERANCE",
    "CONTRACT_TOLERANCE",
    "FAULTS",
    "FAULTS_IN_A_PROCESS",
    "Collision",
    "ContractBroken",
    "GoalSeeking",
    "Mixed",
    "NotCertified",
    "Policy",
    "Ramming",
    "Step",
    "Tally",
    "Trial",
    "UniformRandom",
    "WrongAllocation",
    "actions",
    "assert_certified",
    "assert_collision_free",
    "assert_priority_allocation",
    "backend_contract",
    "closed_loop",
    "closest_approach",
    "crowded",
    "head_on",
    "pairs_within",
    "policies",
    "priorities",
    "radii",
    "scenes",
    "speeds",
    "symmetric",
    "touching",
    "trials",
    "velocities",
]

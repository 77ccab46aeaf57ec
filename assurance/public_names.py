"""Every public name, and where malformed values are handed to it, or why there is nothing to hand over."""

from __future__ import annotations

FUZZED: dict[str, tuple[str, ...]] = {
    "safefilter": (
        "AffineBarrier", "Box", "ConvexProgram", "DifferentialDrive", "HalfSpaces", "Holonomic", "Lidar",
        "LinearConstraint", "PriorityORCA", "SafetyFilter", "Scene", "Separation", "StaticObstacles", "Uncertainty",
        "Worlds", "certify", "compare_backends", "make_backend", "register_backend", "solve",
    ),
    "safefilter.wrappers": ("SafeAction", "SafeParallelEnv", "SafePolicy", "SafeVectorAction"),
    "safefilter.differentiable": ("Projection", "as_tensors"),
    "safefilter.comparison": (
        "Problem", "ProblemSet", "Recorder", "compare_backends", "contenders_of", "read_problems", "shipped_set",
        "truth_of",
    ),
    "envs": ("load_scenario",),
    "envs.scenarios": ("load_scenario",),
}  # fmt: skip
"""Names with an entry in `filter_entries` or `loop_entries`, by the module that offers them."""

ENTRY_OF = {
    "HalfSpaces": "HalfSpaces.stacked",
    "Scene": "Scene",
}
"""Entries of another name than what they hand values to."""

_RECORD = "a record of what was found or chosen: nobody computes with it but who made it"
_ENUM = "an enumeration: Python refuses what is no member"
_PROTOCOL = "a protocol: what keeps it is the user's own, and what that returns is fuzzed as rows of one's own"
_NOTHING = "takes no argument"
_WRITES = "writes what checked records hold; what it writes is fuzzed where it is read"
_BUILDS = "built by the program that runs it, from numbers of its own and not of a policy, a sensor or a file"
_CERTIFIED = f"{_RECORD} (certify refuses altered ones)"
_CHECKS = (
    "is itself a check for tests: on malformed arguments a test fails, which is what a test is for"
)
_STRATEGY = "draws test data; Hypothesis checks its arguments"

NOT_FUZZED: dict[str, dict[str, str]] = {
    "safefilter": {
        **dict.fromkeys(("Capabilities", "Certificate", "Decision", "Solution"), _CERTIFIED),
        **dict.fromkeys(("Case", "Fault", "Status"), _ENUM),
        **dict.fromkeys(("Backend", "Constraint"), _PROTOCOL),
        "SafeFilterError": "the base of errors",
        "available_backends": _NOTHING,
    },
    "safefilter.differentiable": {"Projected": _RECORD},
    "safefilter.comparison": {
        "SHIPPED": "names of sets",
        "Comparison": _RECORD,
        "Contender": _RECORD + "; compare_backends refuses others",
        "Plan": _RECORD + "; compare_backends refuses others",
        "Setting": _ENUM,
        "Summary": _RECORD,
        "Truth": _RECORD,
        "write_problems": _WRITES,
    },
    "envs": {
        **dict.fromkeys(("AfterArrival", "Motion"), _ENUM),
        **dict.fromkeys(("Outcome", "World"), _RECORD),
        **dict.fromkeys(
            ("Circle", "Corridor", "Crossroad", "Crowd", "Doorway", "Fleet", "Navigation", "ObservationLayout", "Rules",
             "Sensing", "Town", "UShape"),
            _BUILDS,
        ),
    },
    "envs.scenarios": {
        "Placement": _RECORD,
        "Scenario": _PROTOCOL,
        "recommended_rules": _BUILDS,
        "scenario_names": _NOTHING,
        "DescribedScenario": "made of files: fuzzed as the layout of assurance.file_loaders",
        **dict.fromkeys(
            ("Circle", "Corridor", "Crossroad", "Doorway", "Packed", "Town", "UShape"), _BUILDS
        ),
    },
    "policies": dict.fromkeys(("BangBang", "Policy", "Ramming", "StraightToGoal", "UniformRandom"), _BUILDS),
    "safefilter.testing": {
        **dict.fromkeys(
            ("BACKEND_CHECKS", "CONTACT_TOLERANCE", "CONTRACT_TOLERANCE", "FAULTS", "FAULTS_IN_A_PROCESS"), "a constant"
        ),
        **dict.fromkeys(
            ("BackendsDisagree", "Collision", "ContractBroken", "NotCertified", "NotFinite", "NotMinimal", "NotTracked",
             "WrongAllocation", "WrongChange"),
            "an error that a check raises",
        ),
        **dict.fromkeys(
            ("Adversary", "AtRandom", "ClosedLoop", "GoalSeeking", "Mixed", "Policy", "Ramming", "Step", "Tally",
             "Trial",
             "UncertainStep", "UncertainTrial", "UniformRandom", "assert_backends_agree", "assert_certified",
             "assert_collision_free", "assert_minimal", "assert_priority_allocation", "assert_smallest_change",
             "assert_tracked", "backend_contract", "closed_loop", "closest_approach", "pairs_within", "roll_out",
             "roll_out_uncertain"),
            _CHECKS,
        ),
        **dict.fromkeys(
            ("actions", "adversarial_policies", "crowded", "degenerate", "head_on", "priorities", "programs", "radii",
             "rollouts", "scenes", "speeds", "symmetric", "touching", "velocities", "walls"),
            _STRATEGY,
        ),
    },
}  # fmt: skip
"""The others, each with the reason."""

"""Methods: the rows of a table, each a policy behind a filter, by name. Adding one is a line in `METHODS`.

Letters: none. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from policies.evaluation import PolicyFactory
from policies.filtering import IMPARTIAL, LITERAL, OFF, OURS, OURS_WITH_MAP, Filtering
from policies.hybrid import Hybrid
from policies.lateness import PUNCTUAL, Lateness
from policies.learned_policy import LearnedPolicy
from policies.nh_orca import NHORCA
from policies.policy import Policy
from policies.policy_weights import Weights
from policies.unpin import Unpinned
from safefilter.errors import InvalidInput

Driver = Literal["nh-orca", "learned", "hybrid-rl", "foreign"]

LATE_STEPS = 1
"""How late all answers come in one trial of late answers, in steps: 0.2 s."""
LATE_SHARE = 0.2
"""Part of the answers that do not come in time in the other."""


@dataclass(frozen=True, slots=True)
class Method:
    """One row of a table.

    Attributes:
        name: What it is called on the command line.
        label: What it is called in tables.
        driver: What proposes actions.
        filtering: What stands between it and the robots.
        training: Preset of `policies.train` whose weights drive; None: nothing is learnt.
        lateness: How late the filter's answers come.
        is_unpinned: Is there a way out for robots held at a wall, see `policies.unpin`?
        about: What it is, in a sentence.
    """

    name: str
    label: str
    driver: Driver
    filtering: Filtering
    training: str | None = None
    lateness: Lateness = PUNCTUAL
    is_unpinned: bool = False
    about: str = ""


_ALL = (
    Method(
        "nh-orca",
        "NH-ORCA",
        "nh-orca",
        IMPARTIAL,
        about="Straight to the goal as far as ORCA lets it; knows the map, and our filter rules collisions out.",
    ),
    Method(
        "drl-cf",
        "DRL-cf",
        "learned",
        OFF,
        "drl-cf",
        about="Learnt without curiosity and without a filter, and driven without one.",
    ),
    Method(
        "drl-cd",
        "DRL-cd",
        "learned",
        OFF,
        "drl-cd",
        about="Learnt with curiosity and without a filter, and driven without one.",
    ),
    Method(
        "hybrid-rl",
        "Hybrid-RL",
        "hybrid-rl",
        OFF,
        "drl-cd",
        about="DRL-cd, straight ahead where nothing is near and careful where something is (Fan et al. 2020).",
    ),
    Method(
        "srl-orca-literal",
        "SRL-ORCA, literal",
        "learned",
        LITERAL,
        "srl-orca",
        about="Our policy behind the paper's filter: Eqs. (15) to (18), no separation rows.",
    ),
    Method(
        "srl-orca",
        "SRL-ORCA, ours",
        "learned",
        OURS,
        "srl-orca",
        is_unpinned=True,
        about="Our policy behind our filter, walls from 360 beams alone.",
    ),
    Method(
        "srl-orca-map",
        "ours, with a map",
        "learned",
        OURS_WITH_MAP,
        "srl-orca",
        is_unpinned=True,
        about="The same, but the filter knows the map; the policy does not.",
    ),
    Method(
        "srl-orca-off",
        "ours, filter off",
        "learned",
        OFF,
        "srl-orca",
        about="The same policy alone.",
    ),
    Method(
        "srl-orca-literal-late",
        "literal, late",
        "learned",
        LITERAL,
        "srl-orca",
        Lateness(share=LATE_SHARE, repeats=True),
        about=f"The paper's filter; {LATE_SHARE:.0%} of its answers come too late, and the last command goes on.",
    ),
    Method(
        "srl-orca-late",
        "ours, late",
        "learned",
        OURS,
        "srl-orca",
        Lateness(share=LATE_SHARE),
        is_unpinned=True,
        about="Ours with as many late answers: the last command has expired, and the watchdog stops the robot.",
    ),
    Method(
        "srl-orca-literal-delayed",
        "literal, delayed",
        "learned",
        LITERAL,
        "srl-orca",
        Lateness(steps=LATE_STEPS),
        about=f"The paper's filter; what it decided {LATE_STEPS * 0.2:.1f} s ago executes now.",
    ),
    Method(
        "srl-orca-delayed",
        "ours, delayed",
        "learned",
        OURS,
        "srl-orca",
        Lateness(steps=LATE_STEPS),
        is_unpinned=True,
        about="Ours with the same delay: outside of what it assumes, and nothing is guaranteed.",
    ),
    Method(
        "srl-orca-pinned",
        "ours, no way out",
        "learned",
        OURS,
        "srl-orca",
        about="Ours without the way out for robots held at walls.",
    ),
    Method(
        "srl-orca-nearest",
        "ours, nearest leg",
        "learned",
        replace(OURS, leg="nearest"),
        "srl-orca",
        is_unpinned=True,
        about="Ours, but the filter takes the nearest leg of the velocity obstacle, not that of the norm.",
    ),
)
_ABLATIONS = {
    "short": "Ours after the paper's number of training steps; what the rows below it change one thing of.",
    "no-norms": "Nothing paid for passing right and overtaking left.",
    "straight-direction": "Facing the goal is paid for, facing the shortest way to it is not.",
    "straight-progress": "Progress and direction as in Eqs. (8) and (9), straight to the goal, not around the walls.",
    "paper-reward": "The paper's weights, with its norm area and without explicit norms.",
    "no-cap": "Trained behind the paper's filter, driven behind ours.",
    "no-filter": "Trained without any filter, driven behind ours.",
    "no-memory": "The policy remembers nothing.",
    "with-trail": "The policy also remembers where it has spent its time, see envs/trail.py.",
}
_MORE = (
    Method(
        "no-filter-off",
        "no-filter, filter off",
        "learned",
        OFF,
        "no-filter",
        about="Trained without any filter with our rewards, and driven without one.",
    ),
    Method(
        "short-off",
        "short, filter off",
        "learned",
        OFF,
        "short",
        about="Trained behind our filter, driven without one.",
    ),
    Method(
        "drl-cd-filtered",
        "DRL-cd, filtered",
        "learned",
        OURS_WITH_MAP,
        "drl-cd",
        is_unpinned=True,
        about="Learnt without a filter, driven behind ours, with a map.",
    ),
    *(
        Method(name, name, "learned", OURS_WITH_MAP, name, is_unpinned=True, about=about)
        for name, about in _ABLATIONS.items()
    ),
    Method(
        "nearest-leg",
        "nearest-leg",
        "learned",
        IMPARTIAL,
        "nearest-leg",
        is_unpinned=True,
        about="Trained and driven behind a filter that knows no side.",
    ),
)
METHODS: dict[str, Method] = {method.name: method for method in (*_ALL, *_MORE)}


def find_method(name: str) -> Method:
    """The method of a name.

    Raises:
        InvalidInput: If there is none.
    """
    if name not in METHODS:
        raise InvalidInput(f"method {name!r}: expected one of {', '.join(METHODS)}")
    return METHODS[name]


def policy_factory(method: Method, weights: Weights | None) -> PolicyFactory:
    """Makes the policy of a method for a run.

    Args:
        method: Any but a foreign one.
        weights: What drives, if something learnt does.

    Raises:
        InvalidInput: If it needs weights and there are none, or it is a foreign one.
    """

    def make(navigation: Navigation) -> Policy:
        policy = _bare_policy(method, weights, navigation)
        return Unpinned(policy, navigation.rules.dt) if method.is_unpinned else policy

    if (weights is None) != (method.training is None) or method.driver == "foreign":
        raise InvalidInput(
            f"method {method.name!r}: expected weights for what is learnt, and for nothing else"
        )
    return make


def layout_of(weights: Weights | None) -> ObservationLayout | None:
    """What a policy with these weights observes; None where nothing is learnt."""
    return None if weights is None else weights.layout


def _bare_policy(method: Method, weights: Weights | None, navigation: Navigation) -> Policy:
    if weights is None:
        return NHORCA(navigation.scenes, navigation.rules.dt)
    if method.driver == "hybrid-rl":
        return Hybrid(weights, navigation)
    return LearnedPolicy.of(weights, navigation, name=method.label)

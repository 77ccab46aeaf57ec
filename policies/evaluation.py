"""Evaluation: episodes of one policy in one scenario, behind one filter, and the row of Table I that comes of them.

Episode e of a seed is the same whoever drives and however many are driven at once: methods are compared in the same
episodes.

Letters: W worlds. SI units.
"""

from __future__ import annotations

from collections.abc import Callable

from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from envs.robot_results import RobotResults
from envs.scenarios import Scenario, recommended_rules
from envs.table_row import TableRow
from policies.filtering import Filtering
from policies.lateness import PUNCTUAL, Lateness
from policies.policy import Policy
from policies.rollout import roll_out
from safefilter.errors import OutOfRange

PolicyFactory = Callable[[Navigation], Policy]
"""Makes the policy of a run: from its `Navigation` it takes what it sees, such as ``navigation.observe``."""

BATCH = 500
"""Worlds that are driven at once: more do not make it faster."""


def make_navigation(
    scenario: Scenario,
    filtering: Filtering,
    *,
    num_worlds: int = 1,
    layout: ObservationLayout | None = None,
    fleet: Fleet | None = None,
) -> Navigation:
    """Worlds of differential drives.

    Args:
        scenario: Where they drive.
        filtering: What walls are known from.
        num_worlds: Number of worlds W.
        layout: What the policy observes; None: see `Navigation`.
        fleet: What the robots are; None: Turtlebots of priority 1.
    """
    drives = Fleet.of(scenario.num_robots, kinematics="differential") if fleet is None else fleet
    rules = filtering.rules(recommended_rules(scenario))
    return Navigation(scenario, drives, rules, num_worlds=num_worlds, layout=layout)


def run_episodes(
    make_policy: PolicyFactory,
    scenario: Scenario,
    filtering: Filtering,
    *,
    episodes: int,
    seed: int,
    layout: ObservationLayout | None = None,
    fleet: Fleet | None = None,
    lateness: Lateness = PUNCTUAL,
    batch: int = BATCH,
) -> RobotResults:
    """Drive episodes, many worlds at once.

    Args:
        make_policy: Makes the policy, once for each batch of worlds.
        scenario: Where robots drive.
        filtering: What stands between the policy and the robots.
        episodes: Number of episodes.
        seed: Of the episodes, and of policies that draw.
        layout: What the policy observes; None: see `Navigation`.
        fleet: What the robots are; None: Turtlebots of priority 1.
        lateness: How late answers come.
        batch: Worlds at once.

    Returns:
        What became of every robot of every episode, in order.

    Raises:
        OutOfRange: If there is no episode, or no world.
    """
    for field, number in (("episodes", episodes), ("batch", batch)):
        if number < 1:
            raise OutOfRange(f"{field}: expected 1 or more, got {number}")
    parts = []
    for first in range(0, episodes, batch):
        navigation = make_navigation(
            scenario,
            filtering,
            num_worlds=min(batch, episodes - first),
            layout=layout,
            fleet=fleet,
        )
        # Speeds come with the placements, and the filter has to know them.
        navigation.reset(seed, first_episode=first)
        rollout = roll_out(
            navigation,
            make_policy(navigation),
            filtering.build(navigation.world, navigation.rules.dt),
            seed=seed,
            first_episode=first,
            lateness=lateness,
            resets=False,
            rest_horizon=filtering.time_horizon,
        )
        parts.append(rollout.results)
    return RobotResults.joined(parts)


def evaluate_policy(
    make_policy: PolicyFactory,
    scenario: Scenario,
    filtering: Filtering,
    *,
    episodes: int,
    seed: int,
    method: str = "policy",
    layout: ObservationLayout | None = None,
) -> TableRow:
    """Drive episodes and count: one row of the table.

    Args:
        make_policy: Makes the policy, once for each batch of worlds.
        scenario: Where robots drive.
        filtering: What stands between the policy and the robots.
        episodes: Number of episodes.
        seed: Of the episodes, and of policies that draw.
        method: What the row calls the policy with its filter.
        layout: What the policy observes; None: see `Navigation`.

    Raises:
        OutOfRange: If there is no episode.
    """
    results = run_episodes(
        make_policy, scenario, filtering, episodes=episodes, seed=seed, layout=layout
    )
    return TableRow.of(scenario.name, method, results)

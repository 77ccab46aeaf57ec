"""Agents: robots of a `Navigation`, each with an episode of its own; what all interfaces to learners share.

Letters: W worlds, N robots a world, the first M of them agents and the others people, F numbers. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from envs.crowd import Crowded
from envs.dynamics import Kinematics
from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.observation_layout import Observations
from envs.outcome import Outcome
from envs.reward import Reward, RewardWeights
from envs.reward_tracker import RewardTracker
from envs.rules import AfterArrival, Rules
from envs.scenarios import Scenario, recommended_rules
from envs.scenarios.library import load_scenario
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.decision import Decision
from safefilter.errors import InvalidInput


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What a step did to the agents.

    Attributes:
        acted: Shape (W, M): whose episode was under way; all else is zero or false for others.
        reward: Shape (W, M).
        terminated: Shape (W, M): arrived or collided.
        truncated: Shape (W, M): the time limit is reached.
        reborn: Shape (W, M): was put back to its start.
        world_over: Shape (W,): nobody is under way any more or will be reborn, or the time is over.
        case: What a filter did to the actions, a `safefilter.Case` or 0, shape (W, N).
        given: What the robots were told, shape (W, N, 2).
        info: Numbers about each agent by name, shape (W, M).
    """

    acted: BoolArray
    reward: FloatArray
    terminated: BoolArray
    truncated: BoolArray
    reborn: BoolArray
    world_over: BoolArray
    case: IntArray
    given: FloatArray
    info: dict[str, npt.NDArray[np.generic]]


class Agents:
    """Steps worlds for agents, and keeps account of whose episode is over.

    An agent's episode ends when its robot arrives or collides. From then on nobody acts for the robot: its body stays
    by the rules, at rest and known to all as not cooperative.

    Attributes:
        navigation: The worlds.
        num_agents: Number of agents M of a world.
        is_over: Whose episode is over, shape (W, M).
    """

    def __init__(
        self,
        navigation: Navigation,
        weights: RewardWeights | None = None,
        *,
        goes_on_when_reborn: bool = False,
    ) -> None:
        """Take over worlds.

        Args:
            navigation: The worlds.
            weights: Weights of the reward.
            goes_on_when_reborn: Where robots are reborn, is an arrival not the end of an episode?

        Raises:
            InvalidInput: If people stand before robots in the scenario, or all are people.
        """
        self.navigation = navigation
        self.num_agents = number_of_agents(navigation.scenario)
        shape = navigation.world.radius.shape
        self.is_over = np.ones((shape[0], self.num_agents), dtype=np.bool_)
        is_reborn = navigation.rules.after_arrival is AfterArrival.REBORN
        self._arrival_ends = not (goes_on_when_reborn and is_reborn)
        self._case = np.zeros(shape, dtype=np.int64)
        self._correction = np.zeros(shape)
        self._tracker = RewardTracker(weights)

    def reset(self, seed: int | None = None, *, worlds: npt.ArrayLike = True) -> None:
        """Begin the episodes of all agents of some worlds.

        Args:
            seed: As for `Navigation.reset`.
            worlds: Which worlds: True for all, or bools of shape (W,).
        """
        self.navigation.reset(seed, worlds=worlds)
        chosen = np.broadcast_to(worlds, (len(self.is_over),))
        self.is_over[chosen] = False

    def note_decisions(self, decision: Decision, robots: IntArray) -> None:
        """Learn what a filter made of some actions of the next step.

        Args:
            decision: Decisions.
            robots: Row in `Navigation.scenes` of each.
        """
        self._case.reshape(-1)[robots] = decision.case
        self._correction.reshape(-1)[robots] = decision.correction

    def step(self, actions: FloatArray) -> Step:
        """Move all robots for one step.

        Args:
            actions: What robots are told, shape (W, N, 2). Whether robots of agents whose episode is over act is up
                to the caller.

        Returns:
            What it did. Who is over afterwards is in ``is_over``.
        """
        world = self.navigation.world
        acted = ~self.is_over
        self._tracker.remember(world)
        outcome = self.navigation.step(actions)
        reward = self._tracker.reward(world, outcome, self._correction)
        step = self._account(acted, outcome, reward, actions)
        self._correction[...] = 0.0
        self._case[...] = 0
        return step

    def observe(self) -> Observations:
        """Observations of all agents, shape (W, M, F)."""
        return self.navigation.observe()[:, : self.num_agents]

    def _account(
        self, acted: BoolArray, outcome: Outcome, reward: Reward, given: FloatArray
    ) -> Step:
        agents = slice(self.num_agents)
        late = outcome.timed_out[:, np.newaxis]
        ended = outcome.arrived | outcome.collided if self._arrival_ends else outcome.collided
        terminated = acted & ended[:, agents]
        truncated = acted & late
        self.is_over |= terminated | truncated | late
        named: dict[str, npt.NDArray[np.generic]] = {
            "clearance": outcome.clearance[:, agents],
            "wall_clearance": outcome.wall_clearance[:, agents],
            "arrived": outcome.arrived[:, agents],
            "collided": outcome.collided[:, agents],
        }
        named |= {f"reward_{name}": term[:, agents] for name, term in reward.by_name().items()}
        return Step(
            acted=acted,
            reward=np.where(acted, reward.total[:, agents], 0.0),
            terminated=terminated,
            truncated=truncated,
            reborn=outcome.reborn[:, agents],
            world_over=outcome.over | outcome.timed_out,
            case=self._case.copy(),
            given=given,
            info=named,
        )


def number_of_agents(scenario: Scenario) -> int:
    """Number M of robots that are no people.

    Args:
        scenario: Places them.

    Raises:
        InvalidInput: If people stand before robots in it, or all are people.
    """
    if not isinstance(scenario, Crowded):
        return scenario.num_robots
    person = scenario.crowd.flags(scenario.num_robots)
    num_agents = int(np.count_nonzero(~person))
    if not num_agents or person[:num_agents].any():
        raise InvalidInput(
            f"scenario {scenario.name!r}: expected robots first and people after them, got people "
            f"{np.flatnonzero(person).tolist()} of {len(person)}"
        )
    return num_agents


def scenario_and_rules(
    scenario: Scenario | str | Path, rules: Rules | None = None
) -> tuple[Scenario, Rules]:
    """Find a scenario, and the rules it is played by.

    Args:
        scenario: A scenario, or the name or file of one; see `load_scenario`.
        rules: Rules of the episode; None: those that the scenario recommends, if it does.

    Raises:
        UnknownScenario: If the library has no such name.
        ScenarioFileError: If the file cannot be used.
    """
    found = load_scenario(scenario) if isinstance(scenario, str | Path) else scenario
    if rules is None:
        rules = recommended_rules(found)
    return found, rules


def drives_unless_told(
    num_robots: int, fleet: Fleet | None, kinematics: Kinematics | None
) -> Fleet:
    """The fleet that is given, or differential drives; moving as is said, if it is."""
    if fleet is None:
        fleet = Fleet.of(num_robots, kinematics="differential")
    return fleet if kinematics is None else replace(fleet, kinematics=kinematics)


def parked_when_done(rules: Rules) -> Rules:
    """Rules for worlds in which nobody acts for a robot that has arrived: it cannot yield, so it counts as parked."""
    if rules.after_arrival is not AfterArrival.YIELD:
        return rules
    return replace(rules, after_arrival=AfterArrival.PARK)

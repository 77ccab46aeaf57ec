from typing import Any

import numpy as np
import pytest

import safefilter as sf
from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.agents import Agents, number_of_agents, parked_when_done, scenario_and_rules
from envs.crowd import Crowd
from envs.reward import RewardWeights
from envs.scenarios import Placement
from safefilter.errors import InvalidInput


class Walkers(Crossroad):
    """A crossroad in which some are people."""

    def __init__(self, people: list[int]) -> None:
        object.__setattr__(self, "people", people)
        super().__init__()

    @property
    def crowd(self) -> Crowd:
        return Crowd(np.array(self.__dict__["people"]))


class Lane:
    """Robots in a row: two are almost at their goals, the last one is far away from it."""

    name, num_robots, half_extent = "lane", 3, 5.0

    def place(self, rng: np.random.Generator) -> Placement:  # noqa: ARG002  # nothing is drawn
        start = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]])
        return Placement(start, start + np.array([[0.15, 0.0], [0.15, 0.0], [4.0, 0.0]]))


def lane(rule: AfterArrival = AfterArrival.PARK, **options: Any) -> Agents:
    rules = Rules(time_limit=1.0, after_arrival=rule, goal_radius=0.05, birth_gap=0.01)
    agents = Agents(Navigation(Lane(), Fleet.of(3), rules), **options)
    agents.reset(0)
    return agents


AHEAD = np.tile([0.2, 0.0], (1, 3, 1))


def test_an_episode_ends_once_and_is_paid_no_more() -> None:
    agents = lane()
    steps = [agents.step(AHEAD) for _ in range(5)]
    terminated = np.array([step.terminated[0] for step in steps])
    truncated = np.array([step.truncated[0] for step in steps])
    assert terminated.sum(axis=0).tolist() == [1, 1, 0]
    assert truncated.sum(axis=0).tolist() == [0, 0, 1]
    arrival = int(terminated[:, 0].argmax())
    assert all(step.reward[0, 0] == 0.0 for step in steps[arrival + 1 :])
    assert all(step.reward[0, 2] != 0.0 for step in steps)
    assert [bool(step.world_over[0]) for step in steps] == [False] * 4 + [True]
    assert agents.is_over.all()


def test_where_robots_are_reborn_an_arrival_ends_an_episode_only_if_asked_to() -> None:
    ends = []
    for goes_on in (False, True):
        agents = lane(AfterArrival.REBORN, goes_on_when_reborn=goes_on)
        steps = [agents.step(AHEAD) for _ in range(4)]
        assert sum(int(step.reborn[0, 0]) for step in steps) == 1
        ends.append(any(step.terminated[0, 0] for step in steps))
    assert ends == [True, False]


def test_decisions_are_told_once_and_paid_for() -> None:
    agents = lane(weights=RewardWeights(intervention=-10.0))
    before = lane(weights=RewardWeights(intervention=-10.0))
    safety_filter = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
    decision = safety_filter.decide(agents.navigation.scene(), np.array([[0.2, 0.2]]), [1])
    assert decision.correction[0] > 0.05
    agents.note_decisions(decision, np.array([1]))
    paid, unpaid = agents.step(AHEAD), before.step(AHEAD)
    assert paid.case.tolist() == [[0, decision.case[0], 0]]
    difference = paid.reward - unpaid.reward
    np.testing.assert_allclose(difference, [[0.0, -10.0 * decision.correction[0], 0.0]])
    assert agents.step(AHEAD).case.tolist() == [[0, 0, 0]]


def test_people_are_no_agents_and_stand_last() -> None:
    assert number_of_agents(Walkers([6, 7])) == 6
    for people in ([0, 7], list(range(8))):
        with pytest.raises(InvalidInput, match="expected robots first and people after them"):
            number_of_agents(Walkers(people))


def test_rules_are_those_given_or_recommended() -> None:
    scenario, rules = scenario_and_rules("rvo2_blocks")
    assert scenario.name
    assert rules.after_arrival is AfterArrival.VANISH
    assert scenario_and_rules("rvo2_blocks", Rules(time_limit=3.0))[1].time_limit == 3.0
    assert scenario_and_rules(Crossroad())[1] == Rules()


def test_nobody_yields_for_whom_nobody_acts() -> None:
    assert parked_when_done(Rules()).after_arrival is AfterArrival.PARK
    vanish = Rules(after_arrival=AfterArrival.VANISH)
    assert parked_when_done(vanish) is vanish

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from envs import Rules
from envs.norm_area import NormArea
from envs.reward import TERMS, Reading, Reward, RewardWeights, reward
from envs.reward_terms import direction
from envs.transition import VECTORS, Transition
from safefilter.errors import InvalidInput, NotFinite

AHEAD = np.array([1.0, 0.0])


def step(**changes: Any) -> Transition:
    """One robot that has driven from (1, 0) to (1.02, 0) on its way from (0, 0) to (3, 0), at half speed."""
    values: dict[str, Any] = {
        "start": [0.0, 0.0],
        "before": [1.0, 0.0],
        "position": [1.02, 0.0],
        "velocity": [0.1, 0.0],
        "facing": AHEAD,
        "goal": [3.0, 0.0],
        "v_max": 0.2,
        "present": True,
        "under_way": True,
        "arrived": False,
        "hit_robot": False,
        "hit_wall": False,
        "timed_out": False,
        "correction": 0.0,
        "way": 0.0,
    } | changes
    return Transition(**{
        name: np.array(value)[np.newaxis, np.newaxis] for name, value in values.items()
    })


def side_by_side(count: int = 2) -> Transition:
    """Robots in contact, abreast, going the same way."""
    steps = [step(position=[0.0, 0.21 * k]) for k in range(count)]
    return Transition(**{
        field.name: np.concatenate([getattr(each, field.name) for each in steps], axis=1)
        for field in fields(Transition)
    })


def paid(found: Reward) -> dict[str, float]:
    """Terms that are not zero."""
    return {name: float(term[0, 0]) for name, term in found.by_name().items() if term[0, 0] != 0.0}


def test_weights_are_the_papers() -> None:
    weights = RewardWeights()
    paper = {"b": 3, "c": 1, "d": -40, "e": -15, "g": -0.25, "m": 80, "n": -2, "q": 0.12}
    assert weights.forward == paper["b"]
    assert weights.direction == paper["c"]
    assert weights.static_collision == paper["d"]
    assert weights.dynamic_collision == paper["e"]
    assert weights.time == paper["g"]
    assert weights.goal == paper["m"]
    assert weights.norm == paper["n"]
    assert Rules().goal_radius == paper["q"]


def test_terms_beyond_the_paper_are_off() -> None:
    weights = RewardWeights()
    assert weights.passing == weights.overtaking == weights.intervention == 0.0
    assert weights.way == weights.way_direction == 0.0


def test_a_step_towards_the_goal_by_hand() -> None:
    # Progress 0.02 m, at half speed straight to the goal.
    expected = {"forward": 3 * 0.02, "direction": math.pi / 2, "time": -0.25}
    assert paid(reward(step(), RewardWeights())) == pytest.approx(expected)


def test_literal_forms_pay_for_all_progress_and_for_facing_the_goal() -> None:
    found = reward(step(), RewardWeights.literal())
    assert paid(found) == pytest.approx({"forward": 3 * 1.02, "direction": math.pi})


def test_literal_direction_pays_at_rest_and_the_default_does_not() -> None:
    resting = step(velocity=[0.0, 0.0], position=[1.0, 0.0])
    assert paid(reward(resting, RewardWeights())) == {"time": -0.25}
    literal = replace(RewardWeights(), course=Reading.LITERAL)
    assert paid(reward(resting, literal)) == pytest.approx({"direction": math.pi, "time": -0.25})


def test_with_the_literal_forms_standing_still_is_worth_more_than_arriving() -> None:
    # Why the defaults differ: at gamma = 0.99, facing the goal for ever against 80 for arriving.
    resting = step(velocity=[0.0, 0.0], position=[1.0, 0.0])
    for_ever = 1.0 / (1.0 - 0.99)
    literal = float(reward(resting, RewardWeights.literal()).total[0, 0]) * for_ever
    working = float(reward(resting, RewardWeights()).total[0, 0]) * for_ever
    assert literal > 300.0 > RewardWeights().goal > 0.0 > working


def test_no_loop_at_full_speed_is_worth_as_much_as_arriving() -> None:
    # Straight to the goal and back at an angle: the angle falls faster than the way covered, so a loop pays a little.
    to, back = np.meshgrid(np.radians(np.arange(90.0)), np.radians(np.arange(91.0, 181.0)))
    rates = []
    for angle in (to, back):
        pay = np.vectorize(direction)(np.cos(angle), np.sin(angle), *AHEAD, 1.0, 1.0)
        rates.append((pay, 1.0 / np.abs(np.cos(angle))))  # reward a step, steps a metre of distance
    (pay_to, steps_to), (pay_back, steps_back) = rates
    loop = (pay_to * steps_to + pay_back * steps_back) / (steps_to + steps_back)
    best = float(loop.max()) + RewardWeights().time
    assert best == pytest.approx(0.131, abs=1e-3)
    assert best / (1.0 - 0.99) < RewardWeights().goal < best / (1.0 - 0.999)


def test_literal_clock_charges_for_being_late_only() -> None:
    literal = replace(RewardWeights.sparse(), clock=Reading.LITERAL)
    assert paid(reward(step(), literal)) == {}
    assert paid(reward(step(timed_out=True), literal)) == {"time": -0.25}


def test_sparse_rewards_have_neither_progress_nor_direction() -> None:
    assert paid(reward(step(), RewardWeights.sparse())) == {"time": -0.25}


@pytest.mark.parametrize(
    ("event", "term", "amount"),
    [
        ("arrived", "goal", 80.0),
        ("hit_robot", "dynamic_collision", -15.0),
        ("hit_wall", "static_collision", -40.0),
    ],
)
def test_events_pay_once(event: str, term: str, amount: float) -> None:
    found = paid(reward(step(**{event: True}), RewardWeights.sparse()))
    assert found == {term: amount, "time": -0.25}


def test_robots_that_are_not_under_way_are_paid_nothing() -> None:
    done = step(under_way=False, hit_robot=True, arrived=True, timed_out=True, correction=0.1)
    for weights in (
        RewardWeights(),
        RewardWeights.literal(),
        replace(RewardWeights(), intervention=-1.0),
    ):
        assert paid(reward(done, weights)) == {}


def test_both_robots_of_overlapping_areas_pay_the_norm() -> None:
    found = reward(side_by_side(), RewardWeights())
    assert found.norm.tolist() == [[-2.0, -2.0]]


def test_area_can_be_another() -> None:
    slim = NormArea.of_paper().corners * 0.1
    weights = replace(RewardWeights(), area=NormArea(slim))
    assert reward(side_by_side(), weights).norm.tolist() == [[0.0, 0.0]]


def test_explicit_norms_pay_the_robot_that_breaks_them() -> None:
    # The second is slower and ahead on the left of the first.
    slow = side_by_side()
    position = np.array([[[0.0, 0.0], [0.5, 0.3]]])
    overtaking = replace(slow, position=position, velocity=np.array([[[0.2, 0.0], [0.1, 0.0]]]))
    weights = replace(RewardWeights(), overtaking=-0.5, passing=-0.7)
    found = reward(overtaking, weights)
    assert found.overtaking.tolist() == [[-0.5, 0.0]]
    assert found.passing.tolist() == [[0.0, 0.0]]
    oncoming = replace(
        overtaking,
        position=np.array([[[0.0, 0.0], [0.5, -0.3]]]),
        facing=np.array([[AHEAD, -AHEAD]]),
    )
    assert reward(oncoming, weights).passing.tolist() == [[-0.7, -0.7]]
    assert reward(oncoming, RewardWeights()).passing.tolist() == [[0.0, 0.0]]


def test_progress_on_the_shortest_way_is_paid_by_the_metre() -> None:
    found = reward(step(way=0.03), replace(RewardWeights.sparse(), way=20.0))
    assert paid(found) == pytest.approx({"time": -0.25, "way": 0.6})


def test_direction_of_the_shortest_way_is_paid_in_proportion_to_the_speed() -> None:
    # 0.02 m of movement at half of the greatest speed, 0.01 m of progress: 60 degrees off the way.
    found = reward(step(way=0.01), replace(RewardWeights.sparse(), way_direction=0.6))
    assert paid(found) == pytest.approx({"time": -0.25, "way_direction": 0.3 * math.pi / 3.0})


def test_intervention_costs_by_the_correction() -> None:
    found = reward(step(correction=0.05), replace(RewardWeights.sparse(), intervention=-2.0))
    assert paid(found) == pytest.approx({"time": -0.25, "intervention": -0.1})


def test_sums_are_equations_6_and_7() -> None:
    terms = {name: np.full((1, 1), 2.0**k) for k, name in enumerate(TERMS)}
    found = Reward(**terms)
    navigation = ("forward", "direction", "static_collision", "dynamic_collision", "time", "goal")
    assert found.navigation == sum(terms[name] for name in navigation)
    assert found.external == found.navigation + terms["norm"]
    assert found.total == sum(terms.values())
    assert found.by_name() == terms


def test_turning_and_mirroring_the_world_changes_no_term_but_the_norms() -> None:
    rng = np.random.default_rng(2)
    arrays: dict[str, Any] = {name: rng.normal(size=(50, 3, 2)) for name in VECTORS}
    arrays |= dict.fromkeys(("v_max", "correction"), np.full((50, 3), 0.2))
    for field in fields(Transition):
        arrays.setdefault(field.name, np.ones((50, 3), dtype=np.bool_))
    many = Transition(**arrays)
    weights = replace(RewardWeights.literal(), norm=0.0, intervention=-1.0)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    for change in (turn, np.diag([1.0, -1.0])):
        changed = replace(many, **{name: getattr(many, name) @ change for name in VECTORS})
        for each in (weights, RewardWeights(norm=0.0)):
            np.testing.assert_allclose(reward(changed, each).total, reward(many, each).total)


@pytest.mark.parametrize("name", TERMS)
def test_weights_must_be_finite(name: str) -> None:
    wrong: dict[str, Any] = {name: math.nan}
    with pytest.raises(NotFinite, match=name):
        RewardWeights(**wrong)


@pytest.mark.parametrize("name", ["progress", "course", "clock"])
def test_readings_must_be_readings(name: str) -> None:
    wrong: dict[str, Any] = {name: "literal"}
    with pytest.raises(InvalidInput, match=f"{name}: expected one of"):
        RewardWeights(**wrong)

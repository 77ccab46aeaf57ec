"""Who gives way: shares sum to one, a higher priority never changes more, equal priorities are RVO2."""

import numpy as np
import pyrvo
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.closest_approach import closest_approach, pairs_within
from safefilter.constraints.priority_orca import Leg, SlackRule, VOpt
from safefilter.constraints.responsibility import responsibility, room
from safefilter.testing.invariants import WrongAllocation, assert_priority_allocation
from safefilter.testing.strategies import head_on, priorities, radii, scenes, symmetric, velocities

TAU = 2.0
DT = 0.2
# Case-3 keeps violations to t* plus this, so that velocities are known to a few times as much.
TOLERANCE = 1e-7


def sees_and_wants(
    scene: sf.Scene, v_opt: VOpt
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    wanted = scene.wanted
    assert wanted is not None
    return scene.velocity if v_opt == "current" else wanted


@given(priorities(), priorities())
def test_responsibilities_and_rooms_sum_to_one(own: float, other: float) -> None:
    assert responsibility(own, other) + responsibility(other, own) == pytest.approx(1.0, abs=1e-15)
    assert room(own, other) + room(other, own) == pytest.approx(1.0, abs=1e-15)
    assert responsibility(own, other) == pytest.approx(room(other, own), abs=1e-15)


@given(
    scenes(),
    st.sampled_from(["current", "shared"]),
    st.sampled_from(["nearest", "norm"]),
)
def test_every_pair_shares_one_change_by_priority(scene: sf.Scene, v_opt: VOpt, leg: Leg) -> None:
    orca = sf.PriorityORCA(TAU, v_opt, leg=leg)
    safety_filter = sf.SafetyFilter([orca, sf.Separation(DT)], sf.Holonomic(1.0))
    assert scene.wanted is not None
    checked = assert_priority_allocation(
        safety_filter,
        scene,
        scene.wanted[scene.cooperative],
        v_opt=sees_and_wants(scene, v_opt),
    )
    num_cooperative = int(scene.cooperative.sum())
    assert checked == num_cooperative * (num_cooperative - 1) // 2


def test_the_rule_as_printed_gives_the_higher_priority_the_worse_part_of_the_slack() -> None:
    scene = sf.Scene.from_world([[0, 0], [3, 0]], [[0.1, 0], [-0.1, 0]], 0.3, priority=[10.0, 1.0])
    paper = sf.SafetyFilter([sf.PriorityORCA(TAU, slack_rule="paper")], sf.Holonomic(2.0))
    with pytest.raises(WrongAllocation, match=r"robots 0 and 1: priorities 10\.0 and 1\.0"):
        assert_priority_allocation(paper, scene, scene.velocity, v_opt=scene.velocity)
    wanted = np.array([[1.5, 0.0], [-1.5, 0.0]])
    high, low = paper.decide(scene, wanted).correction
    assert high > low > 0.0
    dual = sf.SafetyFilter([sf.PriorityORCA(TAU)], sf.Holonomic(2.0))
    high, low = dual.decide(scene, wanted).correction
    assert low > high


@given(symmetric(), st.sampled_from(["current", "shared", "own"]), st.booleans())
def test_higher_priority_never_changes_more_in_a_symmetric_encounter(
    scene: sf.Scene, v_opt: VOpt, has_separation: bool
) -> None:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(TAU, v_opt)]
    if has_separation:
        constraints.append(sf.Separation(DT))
    assert scene.wanted is not None
    decision = sf.SafetyFilter(constraints, sf.Holonomic(2.0)).decide(scene, scene.wanted)
    higher = int(np.argmax(scene.priority))
    high, low = decision.correction[higher], decision.correction[1 - higher]
    assert high <= low + TOLERANCE


@given(symmetric(), velocities(), st.booleans())
def test_higher_priority_never_changes_more_whatever_both_want(
    scene: sf.Scene, wanted: tuple[float, float], has_separation: bool
) -> None:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(TAU)]
    if has_separation:
        constraints.append(sf.Separation(DT))
    both = np.array([wanted, (-wanted[0], -wanted[1])])
    decision = sf.SafetyFilter(constraints, sf.Holonomic(2.0)).decide(scene, both)
    higher = int(np.argmax(scene.priority))
    assert decision.correction[higher] <= decision.correction[1 - higher] + TOLERANCE


@given(head_on(st.sampled_from((0.5, 1.0, 2.0))))
def test_the_higher_priority_of_two_face_to_face_keeps_more_of_its_speed(scene: sf.Scene) -> None:
    low, high = np.argsort(scene.priority)
    assume(scene.priority[high] > 2.0 * scene.priority[low])
    safety_filter = sf.SafetyFilter([sf.PriorityORCA(TAU)], sf.Holonomic(2.0))
    decision = safety_filter.decide(scene, scene.velocity)
    assume(decision.correction[low] > TOLERANCE)
    assert decision.correction[high] < decision.correction[low]


@given(scenes(st.just(2), st.floats(0.01, 3.0), cooperative=st.just(True)))
def test_equal_priorities_are_the_half_planes_of_rvo2(scene: sf.Scene) -> None:
    distance = float(np.hypot(*(scene.position[1] - scene.position[0])))
    equal = sf.Scene.from_world(scene.position, scene.velocity, scene.radius)
    rows = sf.PriorityORCA(TAU, "current").half_spaces(equal, equal.velocity, np.arange(2))
    simulator = pyrvo.RVOSimulator(DT, 15.0, 10, TAU, TAU, 1.0, 5.0)
    for robot in range(2):
        simulator.add_agent(tuple(equal.position[robot].tolist()))
        simulator.set_agent_radius(robot, float(equal.radius[robot]))
        simulator.set_agent_velocity(robot, tuple(equal.velocity[robot].tolist()))
        simulator.set_agent_pref_velocity(robot, tuple(equal.velocity[robot].tolist()))
    simulator.do_step()
    for robot in range(2):
        direction, point = map(np.array, simulator.get_agent_orca_line(robot, 0))
        normal = np.array([-direction[1], direction[0]])
        # RVO2 computes in single precision, and the direction of a short w is worth less.
        assert rows.normals[robot, 0] == pytest.approx(normal, abs=1e-2)
        assert rows.offsets[robot, 0] == pytest.approx(float(normal @ point), abs=1e-2 * distance)


@given(
    st.floats(1.0, 4.0),
    st.tuples(radii(), radii()),
    velocities(1.0),
    velocities(1.0),
    velocities(1.0),
)
def test_a_robot_at_its_wanted_velocity_keeps_it_against_a_millionth_of_its_priority(
    gap: float,
    radius: tuple[float, float],
    own: tuple[float, float],
    other: tuple[float, float],
    other_wants: tuple[float, float],
) -> None:
    # Two steps at full speed stay free between them: separation has no say. Nor has the top speed: its polygon of
    # 64 sides is inscribed, 0.12 % short of the circle.
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [sum(radius) + gap, 0.0]],
        [own, other],
        radius,
        priority=[1e6, 1.0],
        wanted=[own, other_wants],
    )
    safety_filter = sf.SafetyFilter([sf.PriorityORCA(TAU), sf.Separation(DT)], sf.Holonomic(1.01))
    decision = safety_filter.decide(scene, [own], [0])
    relative = np.hypot(own[0] - other[0], own[1] - other[1])
    # Out of the velocity obstacle is never further than to no relative velocity at all.
    assert decision.correction[0] <= 1e-6 * relative + 2e-9


@given(
    st.floats(0.01, 2.0),
    st.tuples(radii(), radii()),
    st.tuples(priorities(), priorities()),
    st.floats(1.1, 4.0),
    st.floats(-0.9, 0.9),
    velocities(),
)
def test_pairs_on_a_collision_course_give_way_together_until_they_graze_and_no_more(
    gap: float,
    radius: tuple[float, float],
    priority: tuple[float, float],
    haste: float,
    aside: float,
    other: tuple[float, float],
) -> None:
    distance = sum(radius) + gap
    angle = aside * np.arcsin(sum(radius) / distance)
    # Fast enough to cover the distance within the horizon, aimed between the two tangents.
    closing = haste * distance / TAU * np.array([np.cos(angle), np.sin(angle)])
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [distance, 0.0]], np.stack([other + closing, other]), radius, priority=priority
    )
    rows = sf.PriorityORCA(TAU).half_spaces(scene, scene.velocity, np.arange(2))
    normal = rows.normals[:, 0]
    parts = rows.offsets[:, 0] - np.einsum("nd,nd->n", normal, scene.velocity)
    assert (parts > 0.0).all()
    assert parts[0] / parts[1] == pytest.approx(priority[1] / priority[0], rel=1e-6)
    velocity = scene.velocity + parts[:, None] * normal
    pairs = pairs_within(scene.world)
    within = closest_approach(scene.position, velocity * TAU, scene.radius, pairs).least[0]
    ever = closest_approach(scene.position, velocity * 100.0 * TAU, scene.radius, pairs).least[0]
    assert within >= -1e-9
    assert ever <= 1e-6


@given(symmetric(), st.sampled_from(["dual", "paper"]))
def test_equal_priorities_share_alike_by_either_rule(
    scene: sf.Scene, slack_rule: SlackRule
) -> None:
    equal = sf.Scene.from_world(scene.position, scene.velocity, scene.radius)
    rows = sf.PriorityORCA(TAU, slack_rule=slack_rule).half_spaces(
        equal, equal.velocity, np.arange(2)
    )
    parts = rows.offsets[:, 0] - np.einsum("nd,nd->n", rows.normals[:, 0], equal.velocity)
    assert parts[0] == pytest.approx(parts[1], abs=1e-12)

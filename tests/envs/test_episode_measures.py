import tracemalloc

import numpy as np
import pytest

import safefilter as sf
from envs import AfterArrival, Circle, Crossroad, Fleet, Navigation, Rules
from envs.episode_measures import EpisodeMeasures
from envs.robot_results import Fate, RobotResults
from envs.table_row import TableRow
from safefilter.arrays import FloatArray


def run(
    navigation: Navigation, num_steps: int, actions: FloatArray | None = None
) -> tuple[EpisodeMeasures, RobotResults]:
    """Straight to the goal, or the same actions all the time."""
    measures = EpisodeMeasures.start(navigation.world)
    for _ in range(num_steps):
        given = navigation.world.preferred_velocity() if actions is None else actions
        given = navigation.wanted(given)
        outcome = navigation.step(given)
        measures.record(navigation.world, outcome, given, navigation.rules.dt)
    return measures, measures.results(navigation.world)


def two_lanes(aside: float, kinematics: str = "holonomic") -> Navigation:
    """Two robots that drive towards each other, the other one this far to the left."""
    fleet = Fleet.of(2, kinematics="differential" if kinematics == "differential" else "holonomic")
    navigation = Navigation(Circle(2), fleet, Rules(time_limit=20.0))
    navigation.reset(0)
    world = navigation.world
    world.position[0] = [[0.0, 0.0], [2.0, aside]]
    world.goal[0] = [[2.0, 0.0], [0.0, aside]]
    world.heading[0] = [0.0, np.pi] if world.is_differential else 0.0
    return navigation


def test_robots_that_pass_on_the_right_and_arrive() -> None:
    _, found = run(two_lanes(0.4), 60)
    assert found.fate.tolist() == [[Fate.SUCCESS] * 2]
    assert found.time == pytest.approx((2.0 - 0.12) / 0.2, abs=0.2)
    assert found.passings_on_right.tolist() == found.passings.tolist() == [[1, 1]]
    assert found.keeps_norms.all()
    assert found.detour == pytest.approx(1.0)
    assert found.min_clearance == pytest.approx(0.4 - 0.21, abs=1e-3)
    assert found.action_variation == pytest.approx(0.0, abs=1e-12)


def test_passing_on_the_left_is_a_success_but_no_social_one() -> None:
    _, found = run(two_lanes(-0.4), 60)
    row = TableRow.of("lanes", "straight", found)
    assert (row.success_rate, row.social_success_rate) == (1.0, 0.0)
    assert row.passing_right_rate == 0.0


def test_head_on_they_collide_with_robots() -> None:
    _, found = run(two_lanes(0.0), 60)
    assert found.fate.tolist() == [[Fate.HIT_ROBOT] * 2]
    assert np.isnan(found.time).all()
    assert TableRow.of("a", "b", found).collision_robot_rate == 1.0


def test_spinning_drives_rotate_in_place() -> None:
    navigation = two_lanes(0.4, "differential")
    _, found = run(navigation, 100, np.full((1, 2, 2), [0.0, 2.5]))
    assert found.fate.tolist() == [[Fate.ROTATED] * 2]
    _, found = run(two_lanes(0.4, "differential"), 100, np.zeros((1, 2, 2)))
    assert found.fate.tolist() == [[Fate.TIMED_OUT] * 2]


def test_reborn_robots_are_measured_way_by_way() -> None:
    rules = Rules(time_limit=40.0, after_arrival=AfterArrival.REBORN)
    navigation = Navigation(Circle(2, jitter_radius=1e-6), rules=rules)
    navigation.reset(0)
    world = navigation.world
    # Two parallel lanes, driven again and again.
    world.position[0] = world.start[0] = [[0.0, 0.0], [2.0, 0.4]]
    world.goal[0] = [[2.0, 0.0], [0.0, 0.4]]
    _, found = run(navigation, rules.max_steps)
    assert (world.arrivals > 2).all()
    assert found.fate.tolist() == [[Fate.SUCCESS] * 2]
    assert found.time == pytest.approx((2.0 - 0.12) / 0.2, abs=0.2)
    assert found.detour == pytest.approx(1.0)
    assert found.passings.tolist() == found.passings_on_right.tolist()
    assert (found.passings >= world.arrivals - 1).all()


def test_reborn_robots_have_no_course() -> None:
    rules = Rules(time_limit=20.0, after_arrival=AfterArrival.REBORN)
    navigation = Navigation(Circle(2, jitter_radius=1e-6), rules=rules)
    navigation.reset(0)
    world = navigation.world
    world.position[0] = world.start[0] = [[0.0, 0.0], [2.0, 0.4]]
    world.goal[0] = [[2.0, 0.0], [0.0, 0.4]]
    measures = EpisodeMeasures.start(world)
    births = 0
    for _ in range(rules.max_steps):
        actions = navigation.wanted(world.preferred_velocity())
        outcome = navigation.step(actions)
        measures.record(world, outcome, actions, rules.dt)
        births += int(outcome.reborn.sum())
        assert (measures.encounters.course[outcome.reborn] == 0.0).all()
        np.testing.assert_array_equal(measures.encounters.position, world.position)
    assert births > 0


def test_people_are_told_apart() -> None:
    navigation = two_lanes(0.4)
    navigation.world.person[0, 1] = True
    measures, found = run(navigation, 1)
    assert found.fate.tolist() == [[Fate.TIMED_OUT, Fate.PERSON]]
    assert measures.motion.steps.tolist() == [[1, 0]]


def test_first_collision_decides_also_for_a_wreck_that_is_hit_again() -> None:
    navigation = Navigation(Crossroad(is_walled=True), num_worlds=4)
    navigation.reset(1)
    rng = np.random.default_rng(0)
    measures = EpisodeMeasures.start(navigation.world)
    first = np.full((4, navigation.world.num_robots), -1)
    course = rng.uniform(-0.2, 0.2, navigation.world.position.shape)
    for _ in range(200):
        outcome = navigation.step(course)
        measures.record(navigation.world, outcome, course, 0.2)
        for place in np.argwhere(outcome.collided):
            w, i = place
            assert first[w, i] == -1, "a robot collides once"
            first[w, i] = Fate.HIT_ROBOT if outcome.hit_robot[w, i] else Fate.HIT_OBSTACLE
    found = measures.results(navigation.world).fate
    collided = first >= 0
    assert {Fate.HIT_ROBOT, Fate.HIT_OBSTACLE} <= set(first.ravel().tolist())
    np.testing.assert_array_equal(found[collided], first[collided])
    assert not np.isin(found[~collided], [Fate.HIT_ROBOT, Fate.HIT_OBSTACLE]).any()
    np.testing.assert_array_equal(collided, navigation.world.collided)


def test_decisions_of_a_filter_are_counted() -> None:
    navigation = two_lanes(0.0)
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
    measures = EpisodeMeasures.start(navigation.world)
    for _ in range(30):
        wanted = navigation.wanted(navigation.world.preferred_velocity())
        decision = safety.decide(navigation.scenes(), wanted.reshape(-1, 2))
        measures.record_decision(decision)
        action = decision.action.reshape(1, 2, 2).astype(np.float64)
        measures.record(navigation.world, navigation.step(action), action, 0.2)
    found = measures.results(navigation.world)
    assert (found.decisions == 30).all()
    assert (found.interventions > 0).all()
    assert (found.min_clearance > 0.0).all()


def test_worlds_are_measured_apart_from_each_other() -> None:
    many = Navigation(Circle(4), num_worlds=3)
    many.reset(5)
    _, together = run(many, 80)
    for w in range(3):
        alone = Navigation(Circle(4))
        alone.reset(5)
        for name in ("position", "goal"):
            start = Navigation(Circle(4), num_worlds=3)
            start.reset(5)
            getattr(alone.world, name)[0] = getattr(start.world, name)[w]
        _, single = run(alone, 80)
        for name in single.__slots__:
            np.testing.assert_array_equal(getattr(single, name)[0], getattr(together, name)[w])


def test_memory_does_not_grow_with_the_episode() -> None:
    navigation = two_lanes(0.4)
    measures, _ = run(navigation, 5)
    still = np.zeros((1, 2, 2))
    outcome = navigation.step(still)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(2000):
        measures.record(navigation.world, outcome, still, 0.2)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 20_000

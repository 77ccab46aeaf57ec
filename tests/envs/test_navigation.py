from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from envs import AfterArrival, Circle, Crossroad, Fleet, Navigation, Outcome, Rules
from envs.scenarios import Placement, Scenario
from safefilter.errors import InvalidInput, NotFinite, OutOfRange, ShapeError


@dataclass(frozen=True)
class HeadOn:
    """Two robots, a metre apart, that want to change places; a third one far away."""

    gap: float = 1.0
    num_robots: int = 3
    half_extent: float = 10.0
    name: str = "head on"

    def place(self, rng: np.random.Generator) -> Placement:
        del rng
        start = np.array([[0.0, 0.0], [self.gap, 0.0], [0.0, 9.0]])
        goal = np.array([[self.gap, 0.0], [0.0, 0.0], [0.0, -9.0]])
        return Placement(start=start, goal=goal)


def started(scenario: Scenario, rules: Rules | None = None, num_worlds: int = 1) -> Navigation:
    navigation = Navigation(scenario, rules=rules, num_worlds=num_worlds)
    navigation.reset(0)
    return navigation


def drive_straight(navigation: Navigation, num_steps: int) -> Outcome:
    for _ in range(num_steps):
        outcome = navigation.step(navigation.world.preferred_velocity())
    return outcome


def test_reset_places_all_robots_at_rest() -> None:
    navigation = started(Crossroad(), num_worlds=3)
    world = navigation.world
    assert world.active.all()
    assert (world.velocity == 0.0).all()
    assert (navigation.time == 0.0).all()
    assert np.isnan(world.arrival_time).all()


def test_same_seed_makes_the_same_episode() -> None:
    first, second = started(Crossroad(), num_worlds=2), started(Crossroad(), num_worlds=2)
    drive_straight(first, 80)
    drive_straight(second, 80)
    np.testing.assert_array_equal(first.world.position, second.world.position)
    first.reset(1)
    assert (first.world.position != second.world.position).any()


def test_a_world_does_not_depend_on_how_many_others_there_are() -> None:
    few, many = started(Crossroad(), num_worlds=2), started(Crossroad(), num_worlds=300)
    drive_straight(few, 70)
    drive_straight(many, 70)
    np.testing.assert_array_equal(few.world.position, many.world.position[:2])
    np.testing.assert_array_equal(few.world.collided, many.world.collided[:2])
    assert many.world.collided.any()


def test_reset_without_a_seed_goes_on_to_other_starts() -> None:
    navigation, again = started(Crossroad()), started(Crossroad())
    before = navigation.world.snapshot()
    navigation.reset()
    assert (navigation.world.position != before.position).any()
    again.reset()
    np.testing.assert_array_equal(navigation.world.position, again.world.position)


def test_reset_of_some_worlds_leaves_the_others_alone() -> None:
    navigation = started(Crossroad(), num_worlds=3)
    drive_straight(navigation, 5)
    before = navigation.world.snapshot()
    navigation.reset(worlds=np.array([False, True, False]))
    np.testing.assert_array_equal(navigation.world.position[[0, 2]], before.position[[0, 2]])
    assert navigation.world.step_count.tolist() == [5, 0, 5]


def test_robots_move_by_velocity_times_dt() -> None:
    navigation = started(Circle(4), Rules(dt=0.5))
    before = navigation.world.snapshot()
    actions = np.full((1, 4, 2), 0.1)
    navigation.step(actions)
    np.testing.assert_allclose(navigation.world.position, before.position + 0.05, atol=1e-15)
    np.testing.assert_array_equal(navigation.world.velocity, actions)
    assert navigation.time.tolist() == [0.5]


def test_single_precision_actions_move_alike() -> None:
    navigation = started(Circle(4))
    navigation.step(np.full((1, 4, 2), 0.125, dtype=np.float32))
    np.testing.assert_array_equal(navigation.world.velocity, 0.125)


def test_robots_that_collide_stop_where_they_touch_and_stay_there() -> None:
    navigation = started(HeadOn(), Rules(after_arrival=AfterArrival.PARK))
    outcomes = [drive_straight(navigation, 1) for _ in range(12)]
    world = navigation.world
    assert sum(int(outcome.num_contacts[0]) for outcome in outcomes) == 1
    assert world.collided.tolist() == [[True, True, False]]
    assert world.cooperative.tolist() == [[False, False, True]]
    assert (world.velocity[0, :2] == 0.0).all()
    distance = np.linalg.norm(world.position[0, 0] - world.position[0, 1])
    assert distance == pytest.approx(2 * 0.105, abs=1e-12)
    assert min(outcome.clearance[0, 0] for outcome in outcomes) < 0.0
    assert [outcome.collided[0].sum() for outcome in outcomes].count(2) == 1


def test_a_collided_robot_never_arrives() -> None:
    navigation = started(HeadOn(gap=0.25), Rules(goal_radius=0.24))
    outcome = drive_straight(navigation, 1)
    assert outcome.collided[0, :2].all()
    assert not navigation.world.arrived[0, :2].any()


def lone_arrival(after_arrival: AfterArrival) -> tuple[Navigation, Outcome]:
    """Robot 0 of a pair arrives after some steps while robot 1 waits a metre beside."""
    navigation = started(HeadOn(), Rules(after_arrival=after_arrival, goal_radius=0.5))
    actions = np.zeros((1, 3, 2))
    actions[0, 0, 0] = 0.2
    actions[0, 1, 1] = 0.2
    while not navigation.world.arrived[0, 0]:
        outcome = navigation.step(actions)
    return navigation, outcome


def test_arrival_is_reported_once_with_its_time() -> None:
    navigation, outcome = lone_arrival(AfterArrival.YIELD)
    assert outcome.arrived.tolist() == [[True, False, False]]
    # Half a metre at 0.2 m/s.
    assert navigation.world.arrival_time[0, 0] == pytest.approx(2.6, abs=0.2001)
    again = navigation.step(np.zeros((1, 3, 2)))
    assert not again.arrived.any()


def test_an_arrived_robot_that_yields_can_still_be_moved() -> None:
    navigation, _ = lone_arrival(AfterArrival.YIELD)
    before = navigation.world.snapshot()
    navigation.step(np.full((1, 3, 2), 0.1))
    assert (navigation.world.position[0, 0] != before.position[0, 0]).all()
    assert navigation.world.cooperative.all()


def test_a_parked_robot_stands_still_and_is_known_not_to_cooperate() -> None:
    navigation, _ = lone_arrival(AfterArrival.PARK)
    before = navigation.world.snapshot()
    navigation.step(np.full((1, 3, 2), 0.1))
    np.testing.assert_array_equal(navigation.world.position[0, 0], before.position[0, 0])
    assert navigation.world.cooperative.tolist() == [[False, True, True]]
    assert (navigation.world.velocity[0, 0] == 0.0).all()


def test_a_vanished_robot_is_met_by_nobody() -> None:
    navigation, _ = lone_arrival(AfterArrival.VANISH)
    assert navigation.world.present.tolist() == [[False, True, True]]
    scene = navigation.scenes()
    assert scene.num_robots == 3
    assert len(scene.neighbours_of(0)) == 0
    assert 0 not in scene.neighbours_of(1)
    outcome = navigation.step(np.zeros((1, 3, 2)))
    assert np.isinf(outcome.clearance[0, 0])


def test_wanted_is_to_stand_still_once_arrived_or_collided() -> None:
    navigation, _ = lone_arrival(AfterArrival.YIELD)
    navigation.world.collided[0, 2] = True
    wanted = navigation.wanted(np.ones((1, 3, 2)))
    np.testing.assert_array_equal(wanted, [[[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]]])


def test_the_episode_is_over_when_nobody_is_under_way() -> None:
    navigation = started(Circle(2), Rules(goal_radius=5.0))
    outcome = navigation.step(np.zeros((1, 2, 2)))
    assert outcome.arrived.all()
    assert outcome.over.tolist() == [True]
    assert outcome.timed_out.tolist() == [False]


def test_the_time_limit_is_reported() -> None:
    navigation = started(Circle(2), Rules(time_limit=0.4))
    steps = [navigation.step(np.zeros((1, 2, 2))) for _ in range(2)]
    assert [bool(outcome.timed_out[0]) for outcome in steps] == [False, True]


def test_scene_holds_one_world_and_scenes_hold_all() -> None:
    navigation = Navigation(
        Crossroad(),
        Fleet.of(8, priority=np.arange(1.0, 9.0)),
        Rules(sensing_range=9.0),
        num_worlds=3,
    )
    navigation.reset(0)
    drive_straight(navigation, 3)
    one, everyone = navigation.scene(1), navigation.scenes()
    assert (one.num_robots, everyone.num_robots) == (8, 24)
    np.testing.assert_array_equal(one.position, everyone.position[8:16])
    np.testing.assert_array_equal(one.velocity, everyone.velocity[8:16])
    np.testing.assert_array_equal(one.priority, np.arange(1.0, 9.0))
    for robot in range(24):
        seen = set(range(8 * (robot // 8), 8 * (robot // 8) + 8)) - {robot}
        assert set(everyone.neighbours_of(robot).tolist()) == seen


def test_wanted_velocities_reach_the_scene() -> None:
    navigation = started(Crossroad(), num_worlds=2)
    wanted = navigation.world.preferred_velocity()
    first, everyone = navigation.scene(1, wanted), navigation.scenes(wanted)
    assert first.wanted is not None
    assert everyone.wanted is not None
    np.testing.assert_array_equal(first.wanted, wanted[1])
    np.testing.assert_array_equal(everyone.wanted, wanted.reshape(-1, 2))


def test_a_scene_does_not_change_with_the_world() -> None:
    navigation = started(Crossroad())
    scene = navigation.scene()
    before = scene.position.copy()
    drive_straight(navigation, 1)
    np.testing.assert_array_equal(scene.position, before)


def test_overlapping_starts_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"robot 0 of world 0 starts 0\.11 m inside another"):
        started(HeadOn(gap=0.1))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda nav: nav.step(np.zeros((8, 2))),
            ShapeError,
            r"actions: expected shape \(1, 8, 2\)",
        ),
        (lambda nav: nav.step(np.full((1, 8, 2), np.nan)), NotFinite, "expected a finite number"),
    ],
)
def test_actions_that_cannot_be_executed_are_refused(
    call: Callable[[Navigation], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call(started(Crossroad()))


def test_a_fleet_of_another_size_is_refused() -> None:
    with pytest.raises(InvalidInput, match="the scenario places 8 robots, the fleet has 3"):
        Navigation(Crossroad(), Fleet.of(3))


def test_no_world_at_all_is_refused() -> None:
    with pytest.raises(OutOfRange, match="num_worlds: expected 1 or more, got 0"):
        Navigation(Crossroad(), num_worlds=0)


def drives(scenario: Scenario, rules: Rules | None = None, num_worlds: int = 1) -> Navigation:
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    navigation = Navigation(scenario, fleet, rules, num_worlds=num_worlds)
    navigation.reset(0)
    return navigation


def test_drives_start_facing_their_goals() -> None:
    world = drives(HeadOn()).world
    np.testing.assert_allclose(world.heading, [[0.0, np.pi, -np.pi / 2]])


def test_drives_follow_arcs_and_show_their_mean_velocity() -> None:
    navigation = drives(HeadOn())
    command = np.zeros((1, 3, 2))
    command[0, 0] = [0.2, 2.0]
    navigation.step(command)
    world = navigation.world
    radius = 0.2 / 2.0
    expected = [radius * np.sin(0.4), radius * (1.0 - np.cos(0.4))]
    np.testing.assert_allclose(world.position[0, 0], expected)
    np.testing.assert_allclose(world.velocity[0, 0], np.array(expected) / 0.2)
    np.testing.assert_allclose(world.heading[0, 0], 0.4)
    assert (world.velocity[0, 1:] == 0.0).all()


def test_headings_stay_within_half_a_turn() -> None:
    navigation = drives(HeadOn())
    command = np.zeros((1, 3, 2))
    command[..., 1] = 2.5
    for _ in range(50):
        navigation.step(command)
    assert (np.abs(navigation.world.heading) <= np.pi).all()
    expected = np.angle(np.exp(1j * (25.0 + np.array([0.0, np.pi, -np.pi / 2]))))
    np.testing.assert_allclose(navigation.world.heading[0], expected, atol=1e-9)


def test_a_robot_that_hits_a_wall_stops_there() -> None:
    navigation = drives(Crossroad(is_walled=True))
    command = np.zeros((1, 8, 2))
    navigation.world.heading[0, 0] = -np.pi / 2
    command[0, 0, 0] = 0.2
    outcomes = [navigation.step(command) for _ in range(12)]
    world = navigation.world
    assert world.collided[0].tolist() == [True] + [False] * 7
    assert sum(int(outcome.hit_wall.sum()) for outcome in outcomes) == 1
    assert not any(outcome.hit_robot.any() for outcome in outcomes)
    assert world.position[0, 0, 1] == pytest.approx(0.105 - 0.7, abs=1e-9)
    assert min(outcome.wall_clearance[0, 0] for outcome in outcomes) < 0.0


def test_scenes_hold_headings_and_walls() -> None:
    navigation = drives(Crossroad(is_walled=True), num_worlds=2)
    for scene in (navigation.scene(1), navigation.scenes()):
        assert scene.heading is not None
        np.testing.assert_array_equal(scene.heading[-8:], navigation.world.heading[1])
        np.testing.assert_array_equal(
            scene.walls[slice(*scene.wall_range[-1]), :4].reshape(-1, 2, 2),
            navigation.world.walls_of(1),
        )
        assert scene.most_walls == 12


def test_wanted_commands_reach_the_scene_as_mean_velocities() -> None:
    navigation = drives(HeadOn())
    command = np.zeros((1, 3, 2))
    command[0, 0] = [0.2, 2.0]
    scene = navigation.scenes(command)
    navigation.step(command)
    assert scene.wanted is not None
    np.testing.assert_array_equal(scene.wanted, navigation.world.velocity[0])


def test_starts_inside_walls_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"robot 0 of world 0 starts 0\.\d+ m inside a wall"):
        drives(Crossroad(is_walled=True, end_margin=0.01))


def test_a_step_equals_a_fine_integration_of_the_unicycle() -> None:
    navigation = drives(Circle(6), Rules(dt=0.3), num_worlds=4)
    world, rng = navigation.world, np.random.default_rng(0)
    num_parts = 20_000
    middle = (np.arange(num_parts) + 0.5) / num_parts
    for _ in range(5):
        command = np.stack([rng.uniform(0, 0.2, (4, 6)), rng.uniform(-2.5, 2.5, (4, 6))], axis=-1)
        place, heading = world.position.copy(), world.heading.copy()
        angle = heading[..., np.newaxis] + command[..., 1:] * 0.3 * middle
        mean = np.stack([np.cos(angle).mean(axis=-1), np.sin(angle).mean(axis=-1)], axis=-1)
        navigation.step(command)
        # The midpoint rule is off by the square of a part.
        np.testing.assert_allclose(
            world.position, place + 0.3 * command[..., :1] * mean, atol=1e-10
        )
        turned = np.angle(np.exp(1j * (heading + 0.3 * command[..., 1])))
        np.testing.assert_allclose(world.heading, turned, atol=1e-12)
        np.testing.assert_allclose(world.turn_rate, command[..., 1], atol=1e-12)


def test_people_do_not_tell_what_they_want() -> None:
    navigation = started(HeadOn())
    navigation.world.person[0, 1] = True
    navigation.world.velocity[0, 1] = [-0.1, 0.0]
    wanted = navigation.scenes(np.full((1, 3, 2), 0.05)).wanted
    assert wanted is not None
    np.testing.assert_allclose(wanted, [[0.05, 0.05], [-0.1, 0.0], [0.05, 0.05]])


def test_a_world_that_is_retired_is_empty_until_its_reset() -> None:
    navigation = started(HeadOn(), num_worlds=2)
    navigation.retire([True, False])
    assert navigation.world.present.tolist() == [[False] * 3, [True] * 3]
    outcome = drive_straight(navigation, 3)
    assert outcome.over.tolist() == [True, False]
    assert np.isinf(outcome.clearance[0]).all()
    navigation.reset(worlds=[True, False])
    assert navigation.world.present.all()


def test_episodes_have_the_same_starts_in_whichever_world_they_are() -> None:
    one, other = started(Crossroad(), num_worlds=3), started(Crossroad(), num_worlds=1)
    other.reset(0, first_episode=2)
    np.testing.assert_array_equal(one.world.position[2], other.world.position[0])

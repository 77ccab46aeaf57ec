import math

import numpy as np
import pytest

from envs import Circle, Fleet, Navigation, Rules
from envs.scenarios import load_scenario
from policies.nh_orca import NHORCA, SLOWING_TIME, orca_filter, preferred_velocity
from policies.rollout import Rollout, roll_out

RNG = np.random.default_rng(0)


def worlds(name: str, num_worlds: int = 4, **fleet: object) -> Navigation:
    scenario = load_scenario(name)
    robots = Fleet.of(scenario.num_robots, kinematics="differential", **fleet)  # type: ignore[arg-type]  # as named
    navigation = Navigation(scenario, robots, scenario.rules, num_worlds=num_worlds)
    navigation.reset(0)
    return navigation


def driven(navigation: Navigation, *, is_filtered: bool) -> Rollout:
    safety_filter = orca_filter(navigation.world, navigation.rules.dt) if is_filtered else None
    policy = NHORCA(navigation.scenes, navigation.rules.dt)
    return roll_out(navigation, policy, safety_filter, seed=0)


def test_robots_want_to_slow_down_in_front_of_their_goals() -> None:
    navigation = worlds("crossroad", num_worlds=1)
    world = navigation.world
    world.goal[0, 0] = world.position[0, 0] + (0.06, 0.08)
    world.goal[0, 1] = world.position[0, 1]
    wanted = preferred_velocity(world)[0]
    np.testing.assert_allclose(wanted[0], np.array([0.06, 0.08]) / SLOWING_TIME)
    assert wanted[1].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(wanted[2:], axis=1), 0.2)


def test_a_robot_alone_goes_straight_at_full_speed() -> None:
    navigation = Navigation(Circle(2, least_radius=5.0), Fleet.of(2), Rules(sensing_range=1.0))
    navigation.reset(0)
    actions = NHORCA(navigation.scenes, 0.2).act(navigation.world, RNG)
    np.testing.assert_allclose(actions, preferred_velocity(navigation.world), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.1, -0.4, 2.0, -3.1])
def test_a_drive_turns_towards_what_it_wants(angle: float) -> None:
    alone = Fleet.of(2, kinematics="differential")
    navigation = Navigation(Circle(2, least_radius=5.0), alone, Rules(sensing_range=1.0))
    navigation.reset(0)
    world = navigation.world
    world.goal[0] = world.position[0] + (2.0, 0.0)
    world.heading[0] = -angle
    speed, turn_rate = NHORCA(navigation.scenes, 0.2).act(world, RNG)[0, 0]
    assert np.sign(np.round(turn_rate, 9)) == np.sign(angle)
    assert abs(turn_rate) <= world.omega_max[0, 0]
    assert 0.0 <= speed <= 0.2
    assert (speed == 0.0) == (abs(angle) > world.omega_max[0, 0] * 0.3)


def test_priorities_are_taken_for_equal() -> None:
    actions = []
    for priority in (1.0, np.geomspace(0.1, 10.0, 8)):
        navigation = worlds("crossroad", priority=priority)
        policy = NHORCA(navigation.scenes, navigation.rules.dt)
        for _ in range(60):
            navigation.step(policy.act(navigation.world, RNG))
        actions.append(policy.act(navigation.world, RNG))
    np.testing.assert_array_equal(actions[0], actions[1])


def test_slow_robots_are_solved_for_at_their_own_speed() -> None:
    navigation = worlds("overtaking")
    commands = NHORCA(navigation.scenes, 0.2).act(navigation.world, RNG)
    assert (commands[..., 0] <= navigation.world.v_max).all()
    np.testing.assert_allclose(navigation.world.v_max[0], [0.2, 0.1])


def test_robots_that_do_not_cooperate_go_straight() -> None:
    navigation = worlds("crossroad", cooperative=np.arange(8) > 0)
    commands = NHORCA(navigation.scenes, 0.2).act(navigation.world, RNG)
    assert commands[0, 0, 0] == pytest.approx(0.2, rel=1e-6)
    everyone = worlds("crossroad", cooperative=False)
    assert np.isfinite(NHORCA(everyone.scenes, 0.2).act(everyone.world, RNG)).all()


def test_new_speeds_after_a_reset_are_taken_up() -> None:
    navigation = worlds("overtaking")
    policy = NHORCA(navigation.scenes, 0.2)
    policy.act(navigation.world, RNG)
    navigation.world.v_max[...] = 0.05
    assert (policy.act(navigation.world, RNG)[..., 0] <= 0.05 + 1e-12).all()


def test_nh_orca_crosses_the_crossroad_without_collision_under_the_filter() -> None:
    summary = driven(worlds("crossroad", num_worlds=6), is_filtered=True).summary
    assert (summary.num_robot_hits, summary.num_wall_hits) == (0, 0)
    assert summary.success_rate > 0.95


def test_nh_orca_stands_still_before_six_traps_of_eight() -> None:
    navigation = worlds("n_c_o_intersection")
    result = driven(navigation, is_filtered=True)
    assert result.summary.success_rate == 2 / 8
    world = navigation.world
    assert (world.arrived == [False] * 6 + [True] * 2).all()
    speed = np.hypot(world.velocity[..., 0], world.velocity[..., 1])
    assert speed[~world.arrived].max() < 0.01
    # They have gone into the mouths of the traps, and no further.
    start = np.array([member.start.draw(RNG) for member in navigation.scenario.members])  # type: ignore[attr-defined]  # the library's
    gone = np.linalg.norm(world.position - start, axis=-1)[:, :6]
    assert gone.min() > 0.4
    assert gone.max() < 1.2


def test_nh_orca_takes_longer_where_the_crossroad_is_narrow() -> None:
    wide = driven(worlds("crossroad", 12), is_filtered=True).summary
    narrow = driven(worlds("crossroad_congested", 12), is_filtered=True).summary
    assert (narrow.num_robot_hits, narrow.num_wall_hits) == (0, 0)
    assert narrow.mean_time > wide.mean_time + 2.0
    assert math.isfinite(narrow.mean_time)

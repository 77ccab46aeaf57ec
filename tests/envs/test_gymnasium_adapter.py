from dataclasses import replace
from typing import Any, cast

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.utils.env_checker import check_env

import envs
import safefilter as sf
from envs.gymnasium_adapter import OneLearner
from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from envs.scenarios import Scenario
from safefilter.arrays import FloatArray

IDS = [
    "envs:Crossroad-v0",
    "envs:Circle-v0",
    "envs:CrossroadDrive-v0",
    "envs:CorridorDrive-v0",
    "envs:DoorwayDrive-v0",
]


def make(env_id: str = IDS[0], **options: Any) -> OneLearner:
    return cast("OneLearner", gymnasium.make(env_id, **options).unwrapped)


def others_filter() -> sf.SafetyFilter:
    return sf.SafetyFilter(
        [sf.PriorityORCA(time_horizon=2.0), sf.Separation(dt=0.2)], sf.Holonomic(v_max=0.2)
    )


def to_goal(env: OneLearner) -> npt.NDArray[np.float32]:
    return np.asarray(env.navigation.world.preferred_velocity()[0, 0], dtype=np.float32)


# Commands are in m/s and rad/s, so that filters can read them: learners that want a normalised space wrap it.
@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space")
@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_gymnasium_accepts_it(env_id: str, render_mode: str | None) -> None:
    check_env(make(env_id, render_mode=render_mode))


def test_gymnasium_accepts_it_with_filtered_others() -> None:
    check_env(make(others_filter=others_filter()), skip_render_check=True)


def test_scenario_and_number_of_neighbours_can_be_chosen() -> None:
    scenario: Scenario = envs.Circle(5)
    env = make(scenario=scenario, layout=ObservationLayout(2, 0))
    observation, _ = env.reset(seed=0)
    assert observation.shape == (9 + 2 * 9,)
    assert env.scene().num_robots == 5


def test_learner_is_robot_zero_of_the_scene() -> None:
    env = make()
    env.reset(seed=0)
    before = env.scene()
    env.step(np.array([0.125, -0.0625], dtype=np.float32))
    after = env.scene()
    np.testing.assert_array_equal(after.velocity[0], [0.125, -0.0625])
    np.testing.assert_allclose(after.position[0] - before.position[0], [0.025, -0.0125])


def test_others_go_straight_to_their_goals_by_default() -> None:
    env = make()
    env.reset(seed=0)
    expected = env.navigation.world.preferred_velocity()[0, 1:]
    env.step(np.zeros(2, dtype=np.float32))
    # In the numbers of an action space.
    np.testing.assert_allclose(env.scene().velocity[1:], expected, atol=1e-8)


def test_others_count_as_cooperative_only_through_a_filter() -> None:
    alone, among = make(), make(others_filter=others_filter())
    alone.reset(seed=0)
    among.reset(seed=0)
    assert alone.scene().cooperative.tolist() == [True] + [False] * 7
    assert among.scene().cooperative.all()


def test_filtered_others_never_collide_with_each_other_but_bare_ones_do() -> None:
    collided = []
    for chosen in (None, others_filter()):
        env = make(others_filter=chosen, fleet=envs.Fleet.of(8))
        env.reset(seed=0)
        # The learner stands aside; the others do not end its episode.
        env.navigation.world.position[0, 0] = [-9.0, -9.0]
        for _ in range(100):
            env.step(np.zeros(2, dtype=np.float32))
        collided.append(int(env.navigation.world.collided.sum()))
    assert collided[0] > 0
    assert collided[1] == 0


def test_others_follow_the_policy_given_and_the_seed_decides_its_chance() -> None:
    def wander(world: envs.World, rng: np.random.Generator) -> FloatArray:
        return rng.uniform(-0.1, 0.1, world.position.shape)

    ends = []
    for seed in (1, 1, 2):
        env = make(others=wander)
        env.reset(seed=seed)
        for _ in range(10):
            env.step(np.zeros(2, dtype=np.float32))
        ends.append(env.scene().position)
    np.testing.assert_array_equal(ends[0], ends[1])
    assert (ends[0] != ends[2]).any()


def test_arrival_terminates_and_pays() -> None:
    env = make(weights=replace(RewardWeights.sparse(), norm=0.0))
    env.reset(seed=0)
    world = env.navigation.world
    world.goal[0, 0] = world.position[0, 0] + [0.13, 0.0]
    _, reward, terminated, truncated, info = env.step(to_goal(env))
    assert (reward, terminated, truncated) == (80.0 - 0.25, True, False)
    assert info["arrived"]
    assert not info["collided"]


def test_collision_terminates_and_costs() -> None:
    env = make(weights=replace(RewardWeights.sparse(), norm=0.0))
    env.reset(seed=0)
    world = env.navigation.world
    world.position[0, 0] = world.position[0, 2] + [0.0, 0.23]
    _, reward, terminated, _, info = env.step(np.array([0.0, -0.2], dtype=np.float32))
    assert (reward, terminated) == (-15.0 - 0.25, True)
    assert info["collided"]
    assert info["clearance"] < 0.0


def test_progress_pays_by_the_metre() -> None:
    env = make(weights=RewardWeights(direction=0.0))
    env.reset(seed=0)
    _, reward, _, _, _ = env.step(to_goal(env))
    assert reward == pytest.approx(3.0 * 0.04 - 0.25, abs=1e-6)


def test_reward_is_the_sum_of_the_terms_in_info() -> None:
    env = make()
    env.reset(seed=0)
    _, reward, _, _, info = env.step(to_goal(env))
    terms = {name: value for name, value in info.items() if name.startswith("reward_")}
    assert reward == pytest.approx(sum(terms.values()))
    # Straight to the goal at full speed: progress, direction and time by hand.
    expected = {"reward_forward": 0.12, "reward_direction": np.pi, "reward_time": -0.25}
    assert {name: value for name, value in terms.items() if value != 0.0} == pytest.approx(
        expected, abs=1e-6
    )


def test_time_limit_truncates() -> None:
    env = make(rules=envs.Rules(time_limit=0.4))
    env.reset(seed=0)
    steps = [env.step(np.zeros(2, dtype=np.float32)) for _ in range(2)]
    assert [step[3] for step in steps] == [False, True]
    assert not any(step[2] for step in steps)


def test_picture_shows_the_present_moment() -> None:
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    env.step(to_goal(env))
    second = env.render()
    assert first is not None
    assert second is not None
    assert first.dtype == np.uint8
    assert first.shape == second.shape
    assert (first != second).any()
    assert make().render() is None


def test_drives_take_commands() -> None:
    env = make("envs:CrossroadDrive-v0")
    env.reset(seed=0)
    space = env.action_space
    assert isinstance(space, gymnasium.spaces.Box)
    np.testing.assert_allclose(space.low, [0.0, -2.5])
    np.testing.assert_allclose(space.high, [0.2, 2.5])
    before = env.navigation.world.heading[0, 0]
    env.step(np.array([0.0, 2.5], dtype=np.float32))
    heading = env.scene().heading
    assert heading is not None
    assert heading[0] == pytest.approx(before + 0.5, abs=1e-6)


def test_kinematics_can_be_chosen() -> None:
    env = make(kinematics="differential")
    env.reset(seed=0)
    assert env.navigation.world.is_differential
    assert env.scene().num_shared_walls == 0


def test_drives_see_the_world_in_their_own_axes() -> None:
    env = make("envs:CrossroadDrive-v0", layout=ObservationLayout(1, 0))
    env.reset(seed=0)
    world = env.navigation.world
    world.heading[0, 0] = 1.0
    world.goal[0, 0] = world.position[0, 0] + [np.cos(1.0), np.sin(1.0)]
    observation, *_ = env.step(np.zeros(2, dtype=np.float32))
    np.testing.assert_allclose(observation[2:4], [1.0, 0.0], atol=1e-6)


def test_filtered_drive_keeps_clear_of_walls_that_a_bare_one_hits() -> None:
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
        sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
    )
    clearances = []
    for is_filtered in (False, True):
        env = make("envs:CorridorDrive-v0")
        env.reset(seed=0)
        env.navigation.world.heading[0, 0] = np.pi / 2
        action = np.array([0.2, 0.0], dtype=np.float32)
        least = np.inf
        for _ in range(25):
            scene = env.scene()
            given = action
            if is_filtered:
                given = safety_filter.decide(scene, action[np.newaxis], [0]).action[0]
            *_, info = env.step(given)
            least = min(least, info["wall_clearance"])
        clearances.append(least)
    assert clearances[0] < 0.0 < clearances[1]

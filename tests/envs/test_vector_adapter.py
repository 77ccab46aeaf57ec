from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import safefilter as sf
from envs import AfterArrival, Fleet, Rules
from envs.observation_layout import ObservationLayout
from envs.scenarios import Placement
from envs.steering import steer
from envs.vector_adapter import VectorRobots
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.wrappers import SafeVectorAction

FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
)


class Lane:
    """Two robots in a row: one is almost at its goal, the other one far away."""

    name, num_robots, half_extent = "lane", 2, 5.0

    def place(self, rng: np.random.Generator) -> Placement:
        start = np.array([[0.0, 0.0], [0.0, 1.0]]) + rng.uniform(0.0, 0.01, (1, 2))
        return Placement(start, start + np.array([[0.15, 0.0], [4.0, 0.0]]))


def lane(rule: AfterArrival = AfterArrival.PARK, **options: Any) -> VectorRobots:
    rules = Rules(time_limit=1.0, after_arrival=rule, goal_radius=0.05, birth_gap=0.01)
    return VectorRobots(Lane(), fleet=Fleet.of(2), rules=rules, **options)


def ahead(lanes: int) -> npt.NDArray[np.float32]:
    return np.tile(np.array([0.2, 0.0], dtype=np.float32), (lanes, 1))


def test_lanes_are_robots_and_spaces_are_batched() -> None:
    env = gymnasium.make_vec("envs:Robots-v0", num_envs=16, scenario="crossroad")
    assert isinstance(env.unwrapped, VectorRobots)
    assert env.unwrapped.robot_of_lane.tolist() == list(range(16))
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.action_space.shape == (16, 2)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)


def test_a_lane_stays_over_until_its_world_ends_and_then_begins_anew() -> None:
    env = lane(num_worlds=2)
    env.reset(seed=0)
    told = [env.step(ahead(4)) for _ in range(7)]
    ends = np.array([step[2] | step[3] for step in told])
    # Arrived after 3 steps; time is over after 5; the reset is in the sixth.
    assert ends[:, 0].tolist() == [False, False, True, True, True, False, False]
    assert ends[:, 1].tolist() == [False, False, False, False, True, False, False]
    assert [bool(step[3][1]) for step in told] == [False] * 4 + [True, False, False]
    assert not any(step[3][0] for step in told)
    rewards = np.array([step[1] for step in told])
    assert (rewards[3:6, 0] == 0.0).all()
    assert rewards[5, 1] == 0.0
    assert (rewards[[0, 1, 2, 6], 0] != 0.0).all()
    has_info = np.array([step[4]["_clearance"][:2] for step in told])
    assert has_info[:, 0].tolist() == [True] * 3 + [False] * 3 + [True]
    np.testing.assert_array_equal(ends[:, :2], ends[:, 2:])


def test_worlds_end_each_in_its_own_time() -> None:
    env = lane(num_worlds=2)
    env.reset(seed=0)
    env.step(ahead(4))
    env.navigation.world.goal[1, 1] = env.navigation.world.position[1, 1] + [0.05, 0.0]
    ends = []
    for _ in range(4):
        *_, terminated, truncated, _ = env.step(ahead(4))
        ends.append((terminated | truncated).tolist())
    assert ends == [
        [False, False, False, True],
        [True, False, True, True],
        [True, False, False, False],
        [True, True, False, False],
    ]
    assert env.navigation.world.step_count.tolist() == [5, 1]


def test_actions_of_lanes_in_their_reset_are_ignored() -> None:
    env = lane()
    env.reset(seed=0)
    for _ in range(3):
        env.step(ahead(2))
    at_goal = env.navigation.world.position[0, 0].copy()
    env.step(ahead(2))
    np.testing.assert_array_equal(env.navigation.world.position[0, 0], at_goal)
    env.step(ahead(2))
    env.step(ahead(2))  # in which the world is reset
    np.testing.assert_array_equal(env.navigation.world.position, env.navigation.world.start)
    assert env.navigation.world.step_count[0] == 0


def test_where_robots_are_reborn_a_lane_begins_when_its_robot_is() -> None:
    env = lane(AfterArrival.REBORN)
    env.reset(seed=0)
    start = env.navigation.world.position[0, 0].copy()
    told = [env.step(ahead(2)) for _ in range(5)]
    assert [bool(step[2][0]) for step in told] == [False, False, True, False, False]
    # Reborn at once; the next step is its reset, and the one after it drives.
    assert told[3][1][0] == 0.0
    np.testing.assert_allclose(env.navigation.world.position[0, 0] - start, [0.04, 0.0], atol=1e-9)
    assert bool(told[4][3][0])


def test_one_call_of_the_filter_decides_for_all_lanes_that_act(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[list[int]] = []
    decide = sf.SafetyFilter.decide

    def counted(self: sf.SafetyFilter, scene: Any, action: Any, index: Any = None) -> Any:
        asked.append(np.asarray(index).tolist())
        return decide(self, scene, action, index)

    monkeypatch.setattr(sf.SafetyFilter, "decide", counted)
    env = SafeVectorAction(
        VectorRobots("crossroad", num_worlds=2, rules=Rules(time_limit=34.0)), FILTER
    )
    world: Any = env.unwrapped
    env.reset(seed=0)
    over = np.zeros(16, dtype=np.bool_)
    collided = arrived = 0
    for _ in range(170):
        state = world.navigation.world
        wanted = steer(state, state.preferred_velocity()).reshape(-1, 2).astype(np.float32)
        *_, terminated, truncated, infos = env.step(wanted)
        assert asked[-1] == np.flatnonzero(~over).tolist()
        collided += int(infos["collided"].sum())
        arrived += int(infos["arrived"].sum())
        over = terminated | truncated
    assert len(asked) == 170
    assert collided == 0
    assert arrived > 8


def test_lengths_of_real_episodes_are_counted_right() -> None:
    env = RecordEpisodeStatistics(lane())
    env.reset(seed=0)
    for _ in range(12):
        env.step(ahead(2))
    lengths = [length for length in env.length_queue if length > 0]
    assert lengths == [3, 5, 3, 5]


def test_observations_come_by_name_too() -> None:
    layout = ObservationLayout(3, 8, has_memory=True)
    env = VectorRobots("passing", num_worlds=2, layout=layout, observation="dict")
    named, _ = env.reset(seed=1)
    assert env.observation_space.contains(named)
    assert isinstance(named, dict)
    assert {name: part.shape for name, part in named.items()} == {
        "own": (4, 9),
        "neighbours": (4, 3, 9),
        "lidar": (4, 8),
        "memory": (4, 13),
    }


def test_people_are_no_lanes_but_in_the_scene() -> None:
    env = VectorRobots("corridor_people", num_worlds=2)
    env.reset(seed=0)
    assert env.robot_of_lane.tolist() == [0, 1, 2, 3, 10, 11, 12, 13]
    assert env.scene().num_robots == 20
    before = env.navigation.world.position[:, 4:].copy()
    env.step(np.zeros((8, 2), dtype=np.float32))
    assert (env.navigation.world.position[:, 4:] != before).any()


def test_numbers_that_make_no_worlds_are_refused() -> None:
    with pytest.raises(OutOfRange, match="expected a multiple of 8, got 12"):
        VectorRobots("crossroad", num_envs=12)
    with pytest.raises(InvalidInput, match="expected one of them, got both"):
        VectorRobots("crossroad", num_envs=8, num_worlds=1)
    with pytest.raises(OutOfRange, match="num_worlds: expected 1 or more, got 0"):
        VectorRobots("crossroad", num_worlds=0)
    env = lane()
    env.reset(seed=0)
    with pytest.raises(ShapeError, match=r"actions: expected shape \(2, 2\), got \(2,\)"):
        env.step(np.zeros(2, dtype=np.float32))

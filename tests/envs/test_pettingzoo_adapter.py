from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

import safefilter as sf
from envs import AfterArrival, Rules
from envs.pettingzoo_adapter import ParallelRobots
from envs.steering import steer
from safefilter.errors import InvalidInput
from safefilter.wrappers import SafeParallelEnv

FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
)
SHORT = Rules(time_limit=20.0)


def made(*, is_filtered: bool, **options: Any) -> Any:
    env = ParallelRobots("crossroad", **({"rules": SHORT} | options))
    return SafeParallelEnv(env, FILTER) if is_filtered else env


def stand_still(env: Any) -> dict[str, Any]:
    return {agent: np.zeros(2, dtype=np.float32) for agent in env.agents}


@pytest.mark.parametrize("is_filtered", [False, True])
@pytest.mark.parametrize("form", ["flat", "dict"])
def test_pettingzoo_accepts_it(
    form: str, capsys: pytest.CaptureFixture[str], *, is_filtered: bool
) -> None:
    parallel_api_test(made(is_filtered=is_filtered, observation=form), num_cycles=150)
    parallel_seed_test(lambda: made(is_filtered=is_filtered, observation=form), num_cycles=20)
    assert "Passed Parallel API test" in capsys.readouterr().out


def test_agents_that_are_done_leave_and_their_bodies_stay() -> None:
    env = ParallelRobots("crossroad", rules=SHORT)
    env.reset(seed=0)
    world = env.navigation.world
    world.goal[0, 3] = world.position[0, 3]
    _, _, terminated, _, infos = env.step(stand_still(env))
    assert terminated == {f"robot_{i}": i == 3 for i in range(8)}
    assert infos["robot_3"]["arrived"]
    assert env.agents == [f"robot_{i}" for i in range(8) if i != 3]
    scene = env.scene()
    assert scene.num_robots == 8
    # Nobody acts for it any more, so that nobody may count on it.
    assert scene.cooperative.tolist() == [i != 3 for i in range(8)]
    observations, *_ = env.step(stand_still(env))
    assert "robot_3" not in observations


def test_those_whose_bodies_vanish_are_gone_from_the_others_sight() -> None:
    env = ParallelRobots("crossroad", rules=Rules(after_arrival=AfterArrival.VANISH))
    env.reset(seed=0)
    world = env.navigation.world
    world.goal[0, 3] = world.position[0, 3]
    env.step(stand_still(env))
    assert not world.present[0, 3]
    assert 3 not in env.scene().neighbours


def test_where_robots_are_reborn_agents_go_on() -> None:
    env = ParallelRobots(
        "crossroad_cyclic", rules=Rules(time_limit=2.0, after_arrival=AfterArrival.REBORN)
    )
    env.reset(seed=0)
    world = env.navigation.world
    world.goal[0, 3] = world.position[0, 3]
    _, _, terminated, _, infos = env.step(stand_still(env))
    assert infos["robot_3"]["arrived"]
    assert not any(terminated.values())
    for _ in range(9):
        _, _, terminated, truncated, _ = env.step(stand_still(env))
    assert all(truncated.values())
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})


def test_filtered_agents_reach_their_goals_without_touching_anything() -> None:
    env = SafeParallelEnv(ParallelRobots("crossroad", rules=Rules(time_limit=40.0)), FILTER)
    env.reset(seed=2)
    world = env.unwrapped.navigation.world
    arrived = 0
    while env.agents:
        wanted = steer(world, world.preferred_velocity())[0].astype(np.float32)
        *_, infos = env.step({agent: wanted[int(agent[6:])] for agent in env.agents})
        for info in infos.values():
            assert info["clearance"] > 0.0
            assert info["wall_clearance"] > 0.0
            arrived += info["arrived"]
    assert arrived >= 6


def test_actions_of_others_are_refused() -> None:
    env = ParallelRobots("passing")
    env.reset(seed=0)
    with pytest.raises(InvalidInput, match=r"expected one for each of \['robot_0', 'robot_1'\]"):
        env.step({"robot_0": np.zeros(2)})


def test_people_are_no_agents() -> None:
    env = ParallelRobots("corridor_people")
    assert env.possible_agents == ["robot_0", "robot_1", "robot_2", "robot_3"]
    env.reset(seed=0)
    assert env.scene().num_robots == 10

"""The same robots, by three interfaces: for one seed and the same actions they tell the same, bit for bit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from envs import AfterArrival, Crossroad, Fleet, Rules
from envs.gymnasium_adapter import OneLearner
from envs.pettingzoo_adapter import ParallelRobots
from envs.reward import RewardWeights
from envs.spaces import ObservationForm
from envs.steering import steer
from envs.vector_adapter import VectorRobots
from envs.world import World
from safefilter.wrappers import SafeAction, SafeParallelEnv, SafeVectorAction

DT, SEED, NUM_ROBOTS = 0.2, 5, 8
HOLONOMIC = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2))
DRIVE = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(DT), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, DT, tracking_error=0.05),
)


@dataclass(frozen=True)
class Setup:
    """What all three are made with."""

    scenario: Any
    fleet: Fleet
    safety_filter: sf.SafetyFilter
    num_beams: int
    form: ObservationForm
    time_limit: float

    def options(self) -> dict[str, Any]:
        return {
            "fleet": self.fleet,
            "rules": Rules(
                time_limit=self.time_limit,
                after_arrival=AfterArrival.PARK,
                num_beams=self.num_beams,
            ),
            "observation": self.form,
            # So that what the filter changes is paid for as well.
            "weights": RewardWeights(intervention=-1.0),
        }


def setups() -> dict[str, Setup]:

    priority = [1.0, 2.0] * 4
    return {
        "crossroad": Setup(Crossroad(), Fleet.of(8, priority=priority), HOLONOMIC, 0, "flat", 27.0),
        "walls from lidar": Setup(
            "crossroad",
            Fleet.of(8, priority=priority, kinematics="differential"),
            DRIVE,
            360,
            "dict",
            33.0,
        ),
    }


class Plan:
    """What all robots want, made from one world and handed to all three interfaces: to the goal, not quite straight."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(0)
        self.actions = np.zeros((1, NUM_ROBOTS, 2))

    def draw(self, world: World) -> npt.NDArray[np.float32]:
        wanted = steer(world, world.preferred_velocity())
        self.actions = wanted * self.rng.uniform(0.9, 1.0, wanted.shape)
        return np.asarray(self.actions[0], dtype=np.float32)


def same(found: Any, expected: Any, path: str) -> None:
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), path
        for key in expected:
            same(found[key], expected[key], f"{path}/{key}")
    else:
        found, expected = np.asarray(found), np.asarray(expected)
        assert found.shape == expected.shape, path
        np.testing.assert_array_equal(found, expected, err_msg=path)


def entry(infos: dict[str, Any], lane: int) -> dict[str, Any]:
    """What a lane is told, as a single environment says it."""
    told: dict[str, Any] = {}
    for key, values in infos.items():
        if not key.startswith("_") and infos[f"_{key}"][lane]:
            told[key] = entry(values, lane) if isinstance(values, dict) else values[lane]
    return told


def lane_of(values: Any, lane: int) -> Any:
    if isinstance(values, dict):
        return {key: part[lane] for key, part in values.items()}
    return values[lane]


@pytest.mark.parametrize("is_filtered", [False, True], ids=["bare", "filtered"])
@pytest.mark.parametrize("name", ["crossroad", "walls from lidar"])
def test_interfaces_agree_step_for_step(name: str, is_filtered: bool) -> None:
    setup, plan = setups()[name], Plan()
    parallel: Any = ParallelRobots(setup.scenario, **setup.options())
    vector: Any = VectorRobots(setup.scenario, num_worlds=2, **setup.options())
    single: Any = OneLearner(
        setup.scenario,
        others=lambda *_: plan.actions,
        others_filter=setup.safety_filter if is_filtered else None,
        **setup.options(),
    )
    world = parallel.navigation.world
    if is_filtered:
        parallel = SafeParallelEnv(parallel, setup.safety_filter)
        vector = SafeVectorAction(vector, setup.safety_filter)
        single = SafeAction(single, setup.safety_filter)
    first, _ = parallel.reset(seed=SEED)
    lanes, _ = vector.reset(seed=SEED)
    alone, _ = single.reset(seed=SEED)
    same(alone, first["robot_0"], "start")
    ends, learner_is_over = {"arrived": 0, "collided": 0, "truncated": 0}, False
    for step in range(round(setup.time_limit / DT)):
        same(lane_of(lanes, 0), first["robot_0"], "observation")
        wanted = plan.draw(world)
        acting = list(parallel.agents)
        if not acting:
            break
        actions = {agent: wanted[int(agent[6:])] for agent in acting}
        first, rewards, terminated, truncated, infos = parallel.step(actions)
        lanes, *told = vector.step(np.concatenate([wanted, np.zeros_like(wanted)]))
        assert set(first) == set(acting)
        for agent in acting:
            lane, path = int(agent[6:]), f"step {step}, {agent}"
            same(lane_of(lanes, lane), first[agent], path)
            expected = (rewards[agent], terminated[agent], truncated[agent])
            assert tuple(part[lane] for part in told[:3]) == expected, path
            same(entry(told[3], lane), infos[agent], path)
            ends["truncated"] += truncated[agent]
            for fate in ("arrived", "collided"):
                ends[fate] += infos[agent][fate]
        if not learner_is_over:
            alone, *outcome, info = single.step(wanted[0])
            same(alone, first["robot_0"], "learner")
            agent = "robot_0"
            assert outcome == [rewards[agent], terminated[agent], truncated[agent]], step
            same(info, infos[agent], f"step {step}, learner")
            learner_is_over = outcome[1] or outcome[2]
        if "robot_0" not in parallel.agents:
            first = {"robot_0": lane_of(lanes, 0)}
    assert learner_is_over
    assert sum(ends.values()) == NUM_ROBOTS
    if is_filtered:
        # Some arrive in time and some do not, so that every kind of end has been compared.
        assert ends["collided"] == 0
        assert ends["arrived"] > 0
        assert ends["truncated"] > 0
    else:
        assert ends["collided"] > 0


def test_vector_begins_its_next_episode_as_the_others_do() -> None:
    options: dict[str, Any] = {"rules": Rules(time_limit=1.0), "kinematics": "differential"}
    parallel = ParallelRobots("passing", **options)
    vector = VectorRobots("passing", **options)
    single = OneLearner("passing", **options)
    parallel.reset(seed=SEED)
    vector.reset(seed=SEED)
    single.reset(seed=SEED)
    for _ in range(6):
        lanes, _, terminated, truncated, _ = vector.step(np.zeros((2, 2), dtype=np.float32))
    assert not terminated.any()
    assert not truncated.any()
    expected, _ = parallel.reset()
    alone, _ = single.reset()
    same(lanes, np.stack([expected["robot_0"], expected["robot_1"]]), "second episode")
    same(alone, expected["robot_0"], "second episode")

"""SafeAction where one action moves many robots."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env

import safefilter as sf
from safefilter.errors import OutOfRange, ShapeError
from safefilter.wrappers import SafeAction

DT = 0.2
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2))
Array = npt.NDArray[Any]


class Fleet(gymnasium.Env[Array, Array]):
    """Robots of radius 0.1 m in a row, 1 m apart; the first ones act, the others are parked."""

    observation_space = Box(-100.0, 100.0, (2,), np.float32)

    def __init__(
        self,
        num_acting: int,
        num_robots: int,
        *,
        dtype: type[np.floating[Any]] = np.float32,
        num_steps: int = 1000,
    ) -> None:
        self.action_space = Box(-0.2, 0.2, (num_acting, 2), dtype)
        self.num_robots = num_robots
        self.num_steps = num_steps
        self.received: list[Array] = []
        self.parked = set(range(num_acting, num_robots))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.position = np.stack([np.arange(float(self.num_robots)), np.zeros(self.num_robots)], 1)
        self.position += self.np_random.uniform(0.0, 0.01, self.position.shape)
        self.velocity = np.zeros_like(self.position)
        self.num_steps_done = 0
        return np.array(self.position[0], dtype=np.float32), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        self.received.append(action.copy())
        self.velocity[: len(action)] = action
        self.position += DT * self.velocity
        self.num_steps_done += 1
        is_over = self.num_steps_done == self.num_steps
        return np.array(self.position[0], dtype=np.float32), 1.0, is_over, False, {}

    def scene(self) -> sf.Scene:
        cooperative = np.array([robot not in self.parked for robot in range(self.num_robots)])
        return sf.Scene.from_world(self.position, self.velocity, 0.1, cooperative=cooperative)


def wrapped(
    fleet: Fleet, index: int | Sequence[int] | None, penalty: float = 0.0
) -> SafeAction[Array]:
    env = SafeAction(fleet, FILTER, index=index, penalty=penalty)
    env.reset(seed=0)
    return env


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
def test_gymnasium_accepts_it() -> None:
    check_env(SafeAction(Fleet(2, 3), FILTER, index=[0, 1]), skip_render_check=True)


def test_those_who_cooperate_are_filtered_and_the_others_act_as_they_please() -> None:
    fleet = Fleet(3, 3)
    env = wrapped(fleet, index=None)
    fleet.parked = {1}
    fleet.position[:, 0] = [0.0, 0.3, 0.6]
    action = np.array([[0.2, 0.0], [0.1, 0.1], [-0.2, 0.0]], dtype=np.float32)
    *_, info = env.step(action)
    told = info["safefilter"]
    assert told["case"][1] == 0
    assert (told["correction"][[0, 2]] > 0.0).all()
    assert told["certified"].tolist() == [True, False, True]
    assert fleet.received[-1][1].tobytes() == action[1].tobytes()
    np.testing.assert_array_equal(told["action"], fleet.received[-1])


def test_nobody_who_cooperates_is_no_error() -> None:
    fleet = Fleet(2, 2, num_steps=1)
    env = wrapped(fleet, index=None)
    fleet.parked = {0, 1}
    action = np.full((2, 2), 0.1, dtype=np.float32)
    *_, info = env.step(action)
    assert fleet.received[-1].tobytes() == action.tobytes()
    assert info["safefilter_episode"]["decisions"] == 0.0


def test_rows_belong_to_the_robots_of_the_index() -> None:
    fleet = Fleet(2, 3)
    env = wrapped(fleet, index=[1, 0])
    fleet.position[1] = fleet.position[2] - [0.2, 0.0]
    east = np.array([[0.2, 0.0], [0.2, 0.0]], dtype=np.float32)
    told = env.step(east)[-1]["safefilter"]
    assert told["correction"][0] == pytest.approx(0.2, abs=1e-3), "robot 1 touches robot 2"
    assert told["correction"][1] == 0.0, "robot 0 is free"


def test_many_robots_never_collide() -> None:
    fleet = Fleet(6, 6, dtype=np.float64)
    env = wrapped(fleet, index=None, penalty=1.0)
    rng = np.random.default_rng(0)
    fleet.position[:] = fleet.position * 0.25
    fleet.position[:, 1] += 0.05 * (-1.0) ** np.arange(6)
    for _ in range(100):
        before = fleet.position.copy()
        _, reward, *_, info = env.step(rng.uniform(-0.2, 0.2, (6, 2)) * [1.0, 0.05])
        assert closest(before, fleet.position) >= 0.2
        assert float(reward) == pytest.approx(1.0 - info["safefilter"]["correction"].sum())


def closest(before: Array, after: Array) -> float:
    """Least distance of two centres in straight motion."""
    i, j = np.triu_indices(len(before), 1)
    offset = before[j] - before[i]
    change = after[j] - after[i] - offset
    square = (change**2).sum(axis=1)
    along = -(offset * change).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    nearest = offset + along.clip(0.0, 1.0)[:, np.newaxis] * change
    return float(np.hypot(nearest[:, 0], nearest[:, 1]).min())


@pytest.mark.parametrize(
    ("index", "error", "message"),
    [
        (0, ShapeError, r"expected shape \(1, 2\), one row a robot, or \(2,\), got \(2, 2\)"),
        ([0, 1, 2], ShapeError, r"expected shape \(3, 2\), one row a robot, got \(2, 2\)"),
        ([0.0, 1.0], ShapeError, "expected an integer, integers or None"),
        ([1, 1], OutOfRange, "expected every robot once"),
        ([0, -1], OutOfRange, "from 0 up"),
    ],
)
def test_index_that_does_not_fit_the_action_space_is_refused(
    index: int | Sequence[int], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        SafeAction(Fleet(2, 3), FILTER, index=index)


def test_scene_of_another_size_needs_an_index() -> None:
    env = wrapped(Fleet(2, 3), index=None)
    with pytest.raises(ShapeError, match="has 2 rows, but the scene 3 robots; pass index="):
        env.step(np.zeros((2, 2), dtype=np.float32))

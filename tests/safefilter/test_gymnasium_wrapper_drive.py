"""SafeAction where actions are commands (v, w), or actions of any other Box."""

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env

import safefilter as sf
from safefilter.errors import OutOfRange
from safefilter.wrappers import SafeAction

DT = 0.2
FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(DT)], sf.DifferentialDrive(0.2, 2.0, DT, 0.05)
)
Array = npt.NDArray[Any]


class Alley(gymnasium.Env[Array, Array]):
    """A differential drive of radius 0.1 m, heading for a parked one 1 m to the east."""

    observation_space = Box(-100.0, 100.0, (3,), np.float64)

    def __init__(self, low: float = 0.0, dtype: Any = np.float32) -> None:
        ends = np.array([[low, -2.0], [0.2, 2.0]], dtype=dtype)
        self.action_space = Box(ends[0], ends[1], dtype=dtype)
        self.received: list[Array] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.pose = np.array([*self.np_random.uniform(-0.01, 0.01, 2), 0.0])
        self.velocity = np.zeros(2)
        return self.pose.copy(), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        self.received.append(action.copy())
        v, w = action.astype(np.float64)
        heading = self.pose[2] + 0.5 * w * DT
        length = v * np.sinc(0.5 * w * DT / np.pi)
        self.velocity = length * np.array([np.cos(heading), np.sin(heading)])
        self.pose = self.pose + DT * np.array([*self.velocity, w])
        return self.pose.copy(), 1.0, False, False, {}

    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(
            np.stack([self.pose[:2], [1.0, 0.0]]),
            np.stack([self.velocity, [0.0, 0.0]]),
            0.1,
            heading=[self.pose[2], 0.0],
            cooperative=[True, False],
        )


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
@pytest.mark.filterwarnings("ignore:.*using a symmetric and normalized space:UserWarning")
def test_gymnasium_accepts_it() -> None:
    check_env(SafeAction(Alley(), FILTER), skip_render_check=True)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_drive_that_rams_another_stops_before_it_and_commands_stay_in_their_space(
    dtype: Any,
) -> None:
    alley = Alley(dtype=dtype)
    env = SafeAction(alley, FILTER)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    cases = set()
    for step in range(150):
        wish = np.array([0.2, 0.0]) if step < 50 else rng.uniform([-0.05, -2.5], [0.3, 2.5])
        *_, info = env.step(wish)
        told = info["safefilter"]
        assert told["certified"] is True
        assert env.action_space.contains(alley.received[-1])
        assert np.hypot(*(alley.pose[:2] - [1.0, 0.0])) >= 0.2
        cases.add(told["case"])
    assert cases >= {1, 2}


def test_safe_command_reaches_the_environment_bit_for_bit() -> None:
    alley = Alley()
    env = SafeAction(alley, FILTER)
    env.reset(seed=0)
    command = np.array([0.2, -1.3], dtype=np.float32)
    *_, info = env.step(command)
    assert alley.received[-1].tobytes() == command.tobytes()
    assert info["safefilter"]["case"] == sf.Case.SAFE
    assert info["safefilter"]["correction"] == 0.0


def test_space_that_begins_above_zero_needs_an_environment_that_can_stop() -> None:
    with pytest.raises(OutOfRange, match=r"speeds start at 0\.01 m/s, .* pass allow_stop=True"):
        SafeAction(Alley(low=0.01), FILTER)
    alley = Alley(low=0.01)
    only_hard = sf.SafetyFilter([sf.Separation(DT)], FILTER.kinematics)
    env = SafeAction(alley, only_hard, allow_stop=True)
    env.reset(seed=0)
    for _ in range(60):
        *_, info = env.step(np.array([0.2, 0.0]))
        assert info["safefilter"]["certified"] is True
        assert np.hypot(*(alley.pose[:2] - [1.0, 0.0])) >= 0.2
    assert min(command[0] for command in alley.received) < 0.01


class Tank(gymnasium.Env[Array, Array]):
    """Three levels that the action raises or lowers."""

    observation_space = Box(-100.0, 100.0, (3,), np.float64)

    def __init__(self) -> None:
        self.action_space = Box(-1.0, 1.0, (3,))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.level = self.np_random.uniform(0.0, 0.1, 3)
        return self.level.copy(), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        self.level = self.level + 0.1 * action.astype(np.float64)
        is_over = bool(self.level.sum() > 1.4)
        return self.level.copy(), 0.0, is_over, False, {}


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
def test_any_box_is_filtered_in_the_state_that_a_function_reads() -> None:
    sum_below = sf.AffineBarrier(
        value=lambda level: 1.5 - level.sum(),
        drift=lambda _: 0.0,
        control=lambda _: [-0.1, -0.1, -0.1],
        gain=0.5,
    )
    safety_filter = sf.SafetyFilter(
        [sum_below], sf.Box(Tank().action_space), backend="clarabel", fallback=np.zeros(3)
    )
    env = SafeAction(Tank(), safety_filter, scene=lambda _, observation, __: observation)
    check_env(env, skip_render_check=True)
    env.reset(seed=0)
    is_over = False
    while not is_over:
        observation, _, is_over, _, info = env.step(np.ones(3))
        assert info["safefilter"]["certified"] is True
        assert info["safefilter"]["multipliers"].shape == (3,)
        assert env.action_space.contains(info["safefilter"]["action"])
    assert observation.sum() <= 1.5
    assert info["safefilter_episode"]["case_2"] > 0.0
    assert info["safefilter_episode"]["min_clearance"] == np.inf

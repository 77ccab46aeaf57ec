"""SafeVectorAction against Gymnasium's own vector of SafeAction environments."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import ClipAction
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError, WrapperOrderError
from safefilter.wrappers import SafeAction, SafeVectorAction

DT = 0.2
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2))
DRIVE = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(DT)], sf.DifferentialDrive(0.2, 2.0, DT, 0.05)
)
Array = npt.NDArray[Any]
Index = int | Sequence[int] | None


class Square(gymnasium.Env[Array, Array]):
    """Robots of radius 0.1 m at random in a square with one wall; the first ones act, the others are parked."""

    observation_space = Box(-100.0, 100.0, (2,), np.float32)

    def __init__(
        self, num_acting: int | None = None, *, num_robots: int = 4, drives: bool = False
    ) -> None:
        shape = (2,) if num_acting is None else (num_acting, 2)
        ends = np.array([[-0.2, -2.0], [0.2, 2.0]] if drives else [[-0.2, -0.2], [0.15, 0.15]])
        low, high = (np.full(shape, end, dtype=np.float32) for end in ends)
        self.action_space = Box(low, high)
        self.num_acting, self.num_robots, self.drives = num_acting or 1, num_robots, drives

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        places = self.np_random.permutation(16)[: self.num_robots]
        self.position = 0.25 * np.stack([places % 4, places // 4], axis=1)
        self.velocity = np.zeros((self.num_robots, 2))
        self.heading = self.np_random.uniform(-3.0, 3.0, self.num_robots)
        self.num_left = int(self.np_random.integers(2, 7))
        return self.observation(), {"left": self.num_left}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        rows = action.reshape(-1, 2).astype(np.float64)
        if self.drives:
            self.heading[: len(rows)] += DT * rows[:, 1]
            angle = self.heading[: len(rows)]
            rows = rows[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self.velocity[: len(rows)] = rows
        self.position = self.position + DT * self.velocity
        self.num_left -= 1
        is_over = self.num_left == 0
        by_time = bool(is_over and self.position[0, 0] > 0.4)
        info = {"left": self.num_left, "executed": action.copy()}
        return self.observation(), 0.1, is_over and not by_time, by_time, info

    def observation(self) -> Array:
        return np.array(self.position[0], dtype=np.float32)

    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(
            self.position,
            self.velocity,
            0.1,
            heading=self.heading if self.drives else None,
            cooperative=np.arange(self.num_robots) < self.num_acting,
            walls=[[[-1.0, 0.9], [1.0, 0.9]]],
        )


def both(
    mode: AutoresetMode,
    index: Index = 0,
    *,
    num_lanes: int = 3,
    safety_filter: sf.SafetyFilter = FILTER,
    penalty: float = 0.3,
    **options: Any,
) -> tuple[Any, Any]:
    """A vector of filtered environments, and a filtered vector of environments."""

    def bare() -> Any:
        return Square(**options)

    def filtered() -> Any:
        return SafeAction(bare(), safety_filter, index=index, penalty=penalty)

    one_by_one = SyncVectorEnv([filtered] * num_lanes, autoreset_mode=mode)
    together = SafeVectorAction(
        SyncVectorEnv([bare] * num_lanes, autoreset_mode=mode),
        safety_filter,
        index=index,
        penalty=penalty,
    )
    return one_by_one, together


def require_same(found: Any, expected: Any, path: str = "") -> None:
    """The same bit for bit, types included."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), path
        for key in expected:
            require_same(found[key], expected[key], f"{path}/{key}")
    elif isinstance(expected, np.ndarray) and expected.dtype != object:
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), path
        assert found.tobytes() == expected.tobytes(), (path, found, expected)
    elif isinstance(expected, np.ndarray | tuple):
        assert len(found) == len(expected), path
        for number, (one, other) in enumerate(zip(found, expected, strict=True)):
            require_same(one, other, f"{path}/{number}")
    else:
        assert found == expected, path


def forget_last_state(results: Any) -> None:
    """Same-step lanes have been reset before a vector wrapper can look at the last state of an episode."""
    final = results[-1].get("final_info", {}).get("safefilter_episode")
    if final is not None:
        final.pop("min_clearance")


def play(one_by_one: Any, together: Any, seed: int, num_steps: int = 12) -> list[Any]:
    """Step both and compare; returns what came."""
    rng = np.random.default_rng(seed)
    mode = together.metadata["autoreset_mode"]
    require_same(together.reset(seed=seed), one_by_one.reset(seed=seed))
    came = []
    for _ in range(num_steps):
        # Some actions are outside the space, and some are no numbers.
        actions = rng.uniform(-0.25, 0.25, together.action_space.shape).astype(np.float32)
        actions[rng.random(actions.shape) < 0.03] = np.nan
        expected, found = one_by_one.step(actions.copy()), together.step(actions.copy())
        if mode == AutoresetMode.SAME_STEP:
            for results in (expected, found):
                forget_last_state(results)
        require_same(found, expected)
        came.append(found)
        over = found[2] | found[3]
        if mode == AutoresetMode.DISABLED and over.any():
            resets = [env.reset(options={"reset_mask": over}) for env in (together, one_by_one)]
            require_same(*resets)
    return came


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize(
    ("index", "options"),
    [
        (0, {}),
        ([0, 1], {"num_acting": 2}),
        (None, {"num_acting": 4}),
        (0, {"drives": True, "safety_filter": DRIVE}),
    ],
    ids=["one robot", "two rows", "all rows", "drive"],
)
def test_equals_a_vector_of_filtered_environments_bit_for_bit(
    mode: AutoresetMode, index: Index, options: dict[str, Any]
) -> None:
    one_by_one, together = both(mode, index, **options)
    came = play(one_by_one, together, seed=0)
    assert sum(int((results[2] | results[3]).sum()) for results in came) >= 4
    infos = [results[-1] for results in came]
    keys = "final_info" if mode == AutoresetMode.SAME_STEP else "safefilter_episode"
    assert any(keys in info for info in infos)
    cases = np.concatenate([
        info["safefilter"]["case"].ravel() for info in infos if "safefilter" in info
    ])
    assert {1, 2} <= set(cases.tolist()), "nothing was corrected"


@given(st.integers(0, 10**6), st.sampled_from(AutoresetMode), st.integers(1, 5))
def test_equals_it_for_any_seed(seed: int, mode: AutoresetMode, num_lanes: int) -> None:
    play(*both(mode, num_lanes=num_lanes), seed=seed)


def test_nothing_is_decided_for_a_lane_in_the_step_in_which_it_resets() -> None:
    _, together = both(AutoresetMode.NEXT_STEP)
    together.reset(seed=0)
    over = np.zeros(3, dtype=np.bool_)
    num_resets = 0
    for _ in range(10):
        *_, terminated, truncated, infos = together.step(np.full((3, 2), 9.0, dtype=np.float32))
        told = infos.get("_safefilter", np.zeros(3, dtype=np.bool_))
        assert told.tolist() == (~over).tolist()
        num_resets += int(over.sum())
        over = terminated | truncated
    assert num_resets > 0


def test_last_step_is_told_of_in_the_final_info_of_same_step_lanes() -> None:
    _, together = both(AutoresetMode.SAME_STEP)
    together.reset(seed=0)
    is_over = False
    while not is_over:
        *_, terminated, truncated, infos = together.step(np.zeros((3, 2), dtype=np.float32))
        is_over = bool((terminated | truncated).any())
    over = terminated | truncated
    final = infos["final_info"]
    for key in ("_safefilter", "_safefilter_episode"):
        assert final[key].tolist() == over.tolist()
    assert final["safefilter"]["certified"].tolist() == over.tolist()
    assert np.isfinite(final["safefilter_episode"]["min_clearance"]).all()
    assert infos["_safefilter"].tolist() == (~over).tolist()


def test_one_scene_for_all_decides_like_one_a_lane() -> None:
    def one_scene(env: Any, observations: Array, _: dict[str, Any]) -> sf.Scene:
        assert observations.shape == (3, 2)
        squares = env.envs
        return sf.Scene.from_world(
            np.concatenate([square.position for square in squares]),
            np.concatenate([square.velocity for square in squares]),
            0.1,
            cooperative=np.tile(np.arange(4) < 1, 3),
            world=np.repeat(np.arange(3), 4),
            walls=[[[-1.0, 0.9], [1.0, 0.9]]],
        )

    one_by_one, _ = both(AutoresetMode.NEXT_STEP, penalty=0.0)
    bare = SyncVectorEnv([Square] * 3)
    play(one_by_one, SafeVectorAction(bare, FILTER, scene=one_scene), seed=1)


def test_environments_in_other_processes_are_filtered_alike() -> None:
    one_by_one, _ = both(AutoresetMode.NEXT_STEP, num_lanes=2)
    apart = gymnasium.vector.AsyncVectorEnv([Square] * 2)
    try:
        play(one_by_one, SafeVectorAction(apart, FILTER, penalty=0.3), seed=2, num_steps=5)
    finally:
        apart.close()


def test_actions_in_a_box_are_decided_lane_by_lane() -> None:
    bound = sf.AffineBarrier(
        value=lambda states: 1.0 - states[:, 0],
        drift=lambda states: np.zeros(len(states)),
        control=lambda states: np.tile([-1.0, 0.0], (len(states), 1)),
        gain=0.5,
    )
    safety_filter = sf.SafetyFilter([bound], sf.Box(Square().action_space), backend="clarabel")
    env: Any = SafeVectorAction(
        SyncVectorEnv([Square] * 3),
        safety_filter,
        scene=lambda *_: np.array([[0.0, 0.0], [0.8, 0.0], [0.9, 0.0]]),
    )
    env.reset(seed=0)
    *_, infos = env.step(np.full((3, 2), 0.15, dtype=np.float32))
    np.testing.assert_allclose(infos["safefilter"]["action"][:, 0], [0.15, 0.1, 0.05], rtol=1e-5)
    assert infos["safefilter"]["certified"].all()


# --- where it may stand ---


def test_action_wrappers_inside_are_refused_around_the_lanes_and_in_them() -> None:
    around = gymnasium.wrappers.vector.ClipAction(SyncVectorEnv([Square]))
    with pytest.raises(WrapperOrderError, match="ClipAction inside the filter transforms actions"):
        SafeVectorAction(around, FILTER)
    inside: Any = SyncVectorEnv([lambda: ClipAction(Square())])
    with pytest.raises(WrapperOrderError, match="ClipAction inside the filter transforms actions"):
        SafeVectorAction(inside, FILTER)
    with pytest.raises(WrapperOrderError, match="SafeAction inside the filter filters actions"):
        SafeVectorAction(SyncVectorEnv([lambda: SafeAction(Square(), FILTER)]), FILTER)
    with pytest.raises(WrapperOrderError, match="SafeVectorAction inside the filter filters"):
        SafeVectorAction(SafeVectorAction(SyncVectorEnv([Square]), FILTER), FILTER)


def test_other_wrappers_may_stand_around_it() -> None:
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(both(AutoresetMode.NEXT_STEP)[1])
    env.reset(seed=0)
    for _ in range(8):
        *_, infos = env.step(np.zeros((3, 2), dtype=np.float32))
        assert ("episode" in infos) == ("safefilter_episode" in infos)


def test_environment_that_does_not_say_how_it_resets_is_refused() -> None:
    env = SyncVectorEnv([Square])
    del env.metadata["autoreset_mode"]
    with pytest.raises(
        InvalidInput, match=r'metadata\["autoreset_mode"\] must say how lanes reset'
    ):
        SafeVectorAction(env, FILTER)


def test_step_before_reset_is_refused() -> None:
    _, together = both(AutoresetMode.NEXT_STEP)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before step\(\)"):
        together.step(np.zeros((3, 2), dtype=np.float32))


def test_actions_of_another_shape_are_refused() -> None:
    _, together = both(AutoresetMode.NEXT_STEP)
    together.reset(seed=0)
    with pytest.raises(ShapeError, match=r"action: expected shape \(3, 2\), got \(2,\)"):
        together.step(np.zeros(2, dtype=np.float32))


def test_penalty_that_is_no_penalty_is_refused() -> None:
    with pytest.raises(OutOfRange, match="penalty: expected a finite number"):
        SafeVectorAction(SyncVectorEnv([Square]), FILTER, penalty=-1.0)

import doctest
import pickle
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import ClipAction, RecordEpisodeStatistics, RescaleAction
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import (
    NotCooperative,
    OutOfRange,
    SceneUnavailable,
    ShapeError,
    WrapperOrderError,
)
from safefilter.wrappers import SafeAction, gymnasium_wrapper

DT = 0.2
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2))
Array = npt.NDArray[Any]


class Yard(gymnasium.Env[Array, Array]):
    """Robots of radius 0.1 m in a row, 1 m apart; the first one acts, the others are parked."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012  # as Gymnasium types it
    observation_space = Box(-100.0, 100.0, (2,), np.float32)

    def __init__(
        self, space: Box | None = None, *, num_robots: int = 2, num_steps: int = 1000
    ) -> None:
        self.action_space = Box(-0.2, 0.2, (2,)) if space is None else space
        self.num_robots = num_robots
        self.num_steps = num_steps
        self.render_mode = "rgb_array"
        self.received: list[Array] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.position = np.stack([np.arange(float(self.num_robots)), np.zeros(self.num_robots)], 1)
        self.position += self.np_random.uniform(0.0, 0.01, self.position.shape)
        self.velocity = np.zeros_like(self.position)
        self.num_steps_done = 0
        return self.observation(), {"time": 0.0}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        self.received.append(action.copy())
        self.velocity[0] = action
        self.position += DT * self.velocity
        self.num_steps_done += 1
        is_over = self.num_steps_done == self.num_steps
        return self.observation(), 1.0, is_over, False, {"time": DT * self.num_steps_done}

    def render(self) -> npt.NDArray[np.uint8]:
        return np.full((2, 2, 3), 7, dtype=np.uint8)

    def observation(self) -> Array:
        return np.array(self.position[0], dtype=np.float32)

    def scene(self) -> sf.Scene:
        cooperative = np.arange(self.num_robots) == 0
        return sf.Scene.from_world(self.position, self.velocity, 0.1, cooperative=cooperative)


class Blind(Yard):
    scene = None  # type: ignore[assignment]  # wrong on purpose


def wrapped(env: gymnasium.Env[Array, Array] | None = None, **options: Any) -> SafeAction[Array]:
    safe = SafeAction(Yard() if env is None else env, FILTER, **options)
    safe.reset(seed=0)
    return safe


def received(env: SafeAction[Array]) -> Array:
    yard = env.unwrapped
    assert isinstance(yard, Yard)
    return yard.received[-1]


# --- what executes ---


@given(
    st.tuples(*[st.floats(-0.140625, 0.140625, width=32)] * 2),
    st.sampled_from([np.float32, np.float64]),
)
def test_safe_action_reaches_the_environment_bit_for_bit(
    wish: tuple[float, float], dtype: Any
) -> None:
    env = wrapped(Yard(Box(-0.2, 0.2, (2,), dtype), num_robots=1))
    action = np.array(wish, dtype=dtype)
    *_, info = env.step(action)
    assert received(env).dtype == action.dtype
    assert received(env).tobytes() == action.tobytes()
    assert info["safefilter"]["case"] == sf.Case.SAFE
    assert info["safefilter"]["correction"] == 0.0


@given(
    st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), min_size=1, max_size=10),
    st.tuples(*[st.floats(0.0, 0.25)] * 4),
    st.sampled_from([np.float32, np.float64]),
)
def test_every_certified_action_lies_in_the_action_space(
    wishes: list[tuple[float, float]], sides: tuple[float, float, float, float], dtype: Any
) -> None:
    low, high = -np.array(sides[:2], dtype=dtype), np.array(sides[2:], dtype=dtype)
    yard = Yard(Box(low, high, dtype=dtype))
    env = wrapped(yard)
    for wish in wishes:
        yard.position[0] = yard.position[1] - [0.21, 0.0]
        *_, info = env.step(np.array(wish))
        assert info["safefilter"]["certified"] is True
        assert env.action_space.contains(received(env))


def test_robot_that_rams_another_collides_bare_but_not_filtered() -> None:
    clearance = {}
    for name, env in (("bare", Yard()), ("filtered", SafeAction(Yard(), FILTER))):
        env.reset(seed=0)
        yard = env.unwrapped
        assert isinstance(yard, Yard)
        distances = []
        for _ in range(40):
            env.step(np.array([0.2, 0.0], dtype=np.float32))
            distances.append(np.hypot(*(yard.position[1] - yard.position[0])) - 0.2)
        clearance[name] = min(distances)
    assert clearance["bare"] < -0.1
    assert 0.0 <= clearance["filtered"] < 0.01


@pytest.mark.parametrize("wish", [np.nan, np.inf, -1e300])
def test_action_that_is_not_finite_stands_still(wish: float) -> None:
    env = wrapped()
    *_, info = env.step(np.array([0.1, wish]))
    np.testing.assert_array_equal(received(env), np.zeros(2, dtype=np.float32))
    assert info["safefilter"]["fault"] == sf.Fault.ACTION_NOT_FINITE
    assert info["safefilter"]["certified"] is True


def test_lists_and_other_dtypes_are_taken_in_the_dtype_of_the_space() -> None:
    env = wrapped()
    env.step([0.1, 0.0])  # type: ignore[arg-type]  # what people do
    assert received(env).dtype == np.float32
    np.testing.assert_array_equal(received(env), np.array([0.1, 0.0], dtype=np.float32))


def test_environment_may_write_into_its_action() -> None:
    class Careless(Yard):
        def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
            result = super().step(action)
            action[:] = 9.0
            return result

    action = np.array([0.1, 0.0], dtype=np.float32)
    *_, info = wrapped(Careless()).step(action)
    assert action[0] == info["safefilter"]["action"][0] == np.float32(0.1)


# --- the scene ---


def test_each_step_is_decided_in_the_scene_at_its_start() -> None:
    seen: list[tuple[Array, Array, float]] = []

    def scene(yard: Yard, observation: Array, info: dict[str, Any]) -> sf.Scene:
        seen.append((yard.position[0].astype(np.float32), observation, info["time"]))
        return yard.scene()

    env = wrapped(scene=scene)
    for _ in range(3):
        env.step(np.array([0.1, 0.0], dtype=np.float32))
    assert [time for *_, time in seen] == pytest.approx([0.0, DT, 2 * DT])
    for position, observation, _ in seen:
        np.testing.assert_array_equal(position, observation)


def test_environment_without_scene_is_refused_or_helped_by_a_function() -> None:
    with pytest.raises(SceneUnavailable, match=r"Blind has no scene\(\) method"):
        SafeAction(Blind(), FILTER)
    env = wrapped(Blind(), scene=lambda yard, *_: Yard.scene(yard))
    assert env.step(np.zeros(2, dtype=np.float32))[-1]["safefilter"]["certified"]


def test_step_before_reset_is_refused() -> None:
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\)"):
        SafeAction(Yard(), FILTER).step(np.zeros(2, dtype=np.float32))


def test_robot_that_others_take_for_unfiltered_is_refused() -> None:
    env = wrapped(index=1)
    with pytest.raises(NotCooperative, match=r"robots \[1\] are flagged cooperative=False"):
        env.step(np.zeros(2, dtype=np.float32))


# --- where it may stand ---


def test_action_wrappers_belong_around_the_filter() -> None:
    with pytest.raises(WrapperOrderError, match="ClipAction"):
        SafeAction(ClipAction(Yard()), FILTER)
    env = RescaleAction(SafeAction(Yard(), FILTER), np.float32(-1.0), np.float32(1.0))
    env.reset(seed=0)
    *_, info = env.step(np.array([0.5, 0.0], dtype=np.float32))
    np.testing.assert_allclose(info["safefilter"]["action"], [0.1, 0.0], rtol=1e-6)


def test_a_filter_inside_a_filter_is_refused() -> None:
    with pytest.raises(WrapperOrderError, match="SafeAction inside the filter filters actions"):
        SafeAction(SafeAction(Yard(), FILTER), FILTER)


def test_seed_options_and_pictures_pass_through() -> None:
    env = SafeAction(Yard(), FILTER)
    first, _ = env.reset(seed=5)
    again, info = Yard().reset(seed=5)
    np.testing.assert_array_equal(first, again)
    assert env.np_random_seed == 5
    assert info == {"time": 0.0}
    np.testing.assert_array_equal(np.asarray(env.render()), 7)


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
def test_gymnasium_accepts_it() -> None:
    check_env(SafeAction(Yard(), FILTER), skip_render_check=True)


def test_environment_is_made_again_from_its_spec_with_the_same_filter() -> None:
    safety_filter = sf.SafetyFilter(
        [sf.Separation(DT)], sf.Holonomic(0.2), backend="clarabel", deadline=5.0
    )
    gymnasium.register(id="Yard-v0", entry_point=f"{__name__}:Yard")
    try:
        env = RecordEpisodeStatistics(
            SafeAction(gymnasium.make("Yard-v0"), safety_filter, penalty=0.5)
        )
        spec = env.spec
        assert spec is not None
        again = gymnasium.make(spec)
    finally:
        del gymnasium.registry["Yard-v0"]
    assert str(again) == str(env)
    assert spec.additional_wrappers[0].kwargs == {
        "safety_filter": safety_filter,
        "scene": None,
        "index": 0,
        "penalty": 0.5,
        "record": None,
        "allow_stop": False,
    }


def test_filter_travels_to_other_processes_with_any_backend() -> None:
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2), backend="osqp", right_bias=0.1
    )
    other = pickle.loads(pickle.dumps(safety_filter))
    scene = sf.Scene.from_world([[0.0, 0.0], [0.4, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)
    wanted = [[0.2, 0.0], [-0.2, 0.0]]
    decisions = [each.decide(scene, wanted) for each in (safety_filter, other)]
    assert decisions[0].backend == decisions[1].backend == "osqp"
    np.testing.assert_array_equal(decisions[0].action, decisions[1].action)


def test_example_in_the_docstring_is_right() -> None:
    results = doctest.testmod(gymnasium_wrapper)
    assert results.attempted > 0
    assert results.failed == 0


# --- what it tells ---


def test_reward_is_less_by_penalty_times_correction() -> None:
    yard = Yard()
    env = wrapped(yard, penalty=3.0)
    yard.position[0] = yard.position[1] - [0.201, 0.0]
    _, reward, *_, info = env.step(np.array([0.2, 0.0], dtype=np.float32))
    correction = info["safefilter"]["correction"]
    assert correction > 0.1
    assert reward == pytest.approx(1.0 - 3.0 * correction)


@pytest.mark.parametrize("penalty", [-1.0, np.nan, np.inf])
def test_penalty_that_is_no_penalty_is_refused(penalty: float) -> None:
    with pytest.raises(OutOfRange, match="penalty: expected a finite number from 0 up"):
        SafeAction(Yard(), FILTER, penalty=penalty)


def test_info_of_the_environment_is_kept_and_not_written_to() -> None:
    class Keeping(Yard):
        def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
            observation, reward, terminated, truncated, self.info = super().step(action)
            return observation, reward, terminated, truncated, self.info

    yard = Keeping()
    *_, info = wrapped(yard).step(np.zeros(2, dtype=np.float32))
    assert info.keys() == {"time", "safefilter"}
    assert yard.info.keys() == {"time"}


def test_vector_environments_stack_the_info_as_numbers() -> None:
    env = gymnasium.vector.SyncVectorEnv([lambda: SafeAction(Yard(num_steps=2), FILTER)] * 3)
    env.reset(seed=0)
    for _ in range(2):
        *_, infos = env.step(np.full((3, 2), 0.1, dtype=np.float32))
    for key in ("safefilter", "safefilter_episode"):
        for name, values in infos[key].items():
            assert values.dtype != object, name
            assert len(values) == 3
    assert infos["safefilter"]["action"].shape == (3, 2)
    env.close()


def test_totals_come_at_the_end_of_an_episode_and_start_anew() -> None:
    yard = Yard(num_steps=4)
    env = wrapped(yard)
    for episode in range(2):
        env.reset(seed=episode)
        infos = []
        for _ in range(4):
            yard.position[0, 0] = yard.position[1, 0] - 0.21
            infos.append(env.step(np.array([0.2, 0.0], dtype=np.float32))[-1])
        assert [("safefilter_episode" in info) for info in infos] == [False, False, False, True]
        steps = [info["safefilter"] for info in infos]
        totals = infos[-1]["safefilter_episode"]
        assert totals["steps"] == totals["decisions"] == totals["interventions"] == 4.0
        assert totals["mean_correction"] == pytest.approx(
            np.mean([step["correction"] for step in steps])
        )
        assert totals["case_2"] + totals["case_3"] == 4.0
        assert totals["certified"] == 1.0
        assert totals["faults"] == 0.0
        # The state after the last step counts too: the robot used part of its gap of 0.01 m in it.
        assert 0.0 <= totals["min_clearance"] < 0.0099


def test_index_beyond_the_scene_is_refused() -> None:
    with pytest.raises(OutOfRange, match=r"the scene has robots 0 to 1, got \[2\]"):
        wrapped(index=2).step(np.zeros(2, dtype=np.float32))


def test_action_of_another_shape_is_refused() -> None:
    with pytest.raises(ShapeError, match=r"action: expected shape \(2,\), got \(3,\)"):
        wrapped().step(np.zeros(3, dtype=np.float32))


def test_index_of_nobody_in_particular_needs_a_row_for_each() -> None:
    with pytest.raises(
        ShapeError, match=r"None needs an action space of shape \(N, 2\), got \(2,\)"
    ):
        SafeAction(Yard(), FILTER, index=None)

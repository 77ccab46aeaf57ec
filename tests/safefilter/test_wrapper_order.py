from collections.abc import Callable
from typing import Any, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium import wrappers

from safefilter.errors import SafeFilterError, WrapperOrderError
from safefilter.wrappers.wrapper_order import CHANGES, require_innermost

AnyEnv: TypeAlias = gymnasium.Env[Any, Any]
Wrap: TypeAlias = Callable[[AnyEnv], AnyEnv]


class Point(gymnasium.Env[npt.NDArray[np.float32], npt.NDArray[np.float32]]):
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))


class Mirror(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Changes actions without being an ActionWrapper, and says so in its action space only."""

    def __init__(self, env: AnyEnv) -> None:
        super().__init__(env)
        self.action_space = gymnasium.spaces.Box(-2.0, 2.0, (2,))


class Noisy(gymnasium.Wrapper[Any, Any, Any, Any]):
    changes_actions = "adds noise"


CHANGING: dict[str, Wrap] = {
    "ClipAction": wrappers.ClipAction,
    "RescaleAction": lambda env: wrappers.RescaleAction(env, np.float32(-2.0), np.float32(2.0)),
    "TransformAction": lambda env: wrappers.TransformAction(env, lambda action: action, None),
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.5),
    "Autoreset": wrappers.Autoreset,
    "MaxAndSkipObservation": wrappers.MaxAndSkipObservation,
    "Mirror": Mirror,
    "Noisy": Noisy,
}
if hasattr(wrappers, "RepeatAction"):
    CHANGING["RepeatAction"] = lambda env: wrappers.RepeatAction(env, 2)

PASSING: dict[str, Wrap] = {
    "nothing": lambda env: env,
    "TimeLimit": lambda env: wrappers.TimeLimit(env, 10),
    "OrderEnforcing": wrappers.OrderEnforcing,
    "PassiveEnvChecker": wrappers.PassiveEnvChecker,
    "RecordEpisodeStatistics": wrappers.RecordEpisodeStatistics,
    "FlattenObservation": wrappers.FlattenObservation,
    "NormalizeObservation": wrappers.NormalizeObservation,
    "FrameStackObservation": lambda env: wrappers.FrameStackObservation(env, 2),
    "TransformReward": lambda env: wrappers.TransformReward(env, lambda reward: reward),
    "NormalizeReward": wrappers.NormalizeReward,
}


@pytest.mark.parametrize("name", CHANGING)
def test_wrapper_that_changes_actions_is_refused_by_name(name: str) -> None:
    env = CHANGING[name](Point())
    with pytest.raises(WrapperOrderError, match=f"^{name} inside the filter"):
        require_innermost(env)


@pytest.mark.parametrize("name", CHANGING)
def test_wrapper_is_found_under_harmless_ones(name: str) -> None:
    env: AnyEnv = wrappers.OrderEnforcing(wrappers.TimeLimit(CHANGING[name](Point()), 10))
    with pytest.raises(WrapperOrderError, match=f"{name} around the filter"):
        require_innermost(env)


@pytest.mark.parametrize("name", PASSING)
def test_wrapper_that_hands_actions_through_is_allowed(name: str) -> None:
    require_innermost(PASSING[name](Point()))


def test_every_action_wrapper_of_gymnasium_is_tried() -> None:
    classes = {
        name: value
        for name in wrappers.__all__
        if name in vars(wrappers) and isinstance(value := getattr(wrappers, name), type)
    }
    subclasses = {
        name for name, value in classes.items() if issubclass(value, gymnasium.ActionWrapper)
    }
    assert subclasses <= {*CHANGING, "DiscretizeAction"}
    assert "AtariPreprocessing" in classes
    assert set(CHANGES) - set(CHANGING) <= {"AtariPreprocessing", "RepeatAction"}


def test_wrapper_to_a_discrete_space_is_refused() -> None:
    if not hasattr(wrappers, "DiscretizeAction"):
        pytest.skip("this gymnasium has no DiscretizeAction")
    with pytest.raises(WrapperOrderError, match="DiscretizeAction"):
        require_innermost(wrappers.DiscretizeAction(Point(), bins=3))


def test_wrapper_of_ones_own_can_say_what_it_does() -> None:
    with pytest.raises(WrapperOrderError, match=r"^Noisy inside the filter adds noise"):
        require_innermost(Noisy(Point()))


def test_message_says_what_the_wrapper_does_and_where_it_belongs() -> None:
    with pytest.raises(WrapperOrderError) as raised:
        require_innermost(Mirror(Point()))
    assert isinstance(raised.value, SafeFilterError)
    assert isinstance(raised.value, TypeError)
    assert "has another action space" in str(raised.value)
    assert "put the filter around the environment first" in str(raised.value)

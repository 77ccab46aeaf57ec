from typing import Any

import gymnasium
import numpy as np
import pytest

import safefilter as sf
from safefilter.errors import SceneUnavailable, ShapeError
from safefilter.wrappers.vector_scenes import VectorScenes

ALONE = sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1)


class Silent(gymnasium.Env[Any, Any]):
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))


class Speaking(Silent):
    def scene(self) -> sf.Scene:
        return ALONE


def vector(*kinds: type[Silent]) -> Any:
    return gymnasium.vector.SyncVectorEnv(list(kinds))


class OneForAll:
    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(np.zeros((3, 2)), np.zeros((3, 2)), 0.1, world=[1, 0, 1])


def test_environments_of_the_lanes_are_asked() -> None:
    lanes = VectorScenes(vector(Speaking, Speaking), 2, None, has_robots=True)({}, {})
    assert lanes.sizes.tolist() == [1, 1]


def test_vector_environment_may_know_all_in_one_scene() -> None:
    lanes = VectorScenes(OneForAll(), 2, None, has_robots=True)({}, {})
    assert lanes.sizes.tolist() == [1, 2]


def test_function_goes_first_and_is_told_the_latest() -> None:
    told: list[Any] = []

    def scenes(*latest: Any) -> list[sf.Scene]:
        told.extend(latest)
        return [ALONE, ALONE]

    env = OneForAll()
    lanes = VectorScenes(env, 2, scenes, has_robots=True)("observations", {"key": 1})
    assert told == [env, "observations", {"key": 1}]
    assert lanes.sizes.tolist() == [1, 1]


@pytest.mark.parametrize("env", [vector(Speaking, Silent), object()])
def test_lanes_without_scenes_are_refused(env: Any) -> None:
    with pytest.raises(SceneUnavailable, match=r"has no scene\(\) method, .* or pass scene="):
        VectorScenes(env, 2, None, has_robots=True)


@pytest.mark.parametrize(
    ("found", "error", "message"),
    [
        ([ALONE], ShapeError, "expected 2 scenes, one an environment, got 1"),
        ([ALONE, None], SceneUnavailable, r"expected a safefilter\.Scene, got NoneType"),
        ({"scene": ALONE}, SceneUnavailable, r"or one Scene for all with world=; got dict"),
    ],
)
def test_what_is_not_a_scene_a_lane_is_refused(
    found: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        VectorScenes(None, 2, lambda *_: found, has_robots=True)({}, {})


def test_constraints_of_a_box_are_handed_what_there_is() -> None:
    states = np.zeros((2, 3))
    lanes = VectorScenes(None, 2, lambda *_: states, has_robots=False)({}, {})
    assert lanes.scene is states
    assert lanes.robots.tolist() == [0, 1]


def test_lanes_may_be_robots_of_shared_worlds() -> None:
    env = OneForAll()
    env.robot_of_lane = np.array([2, 0, 1])  # type: ignore[attr-defined]  # an environment may have it or not
    lanes = VectorScenes(env, 3, None, has_robots=True)({}, {})
    assert lanes.robots.tolist() == [2, 0, 1]
    assert lanes.sizes.tolist() == [1, 1, 1]

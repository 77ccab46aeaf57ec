from typing import Any

import pytest

from safefilter.errors import SceneUnavailable
from safefilter.scene import Scene
from safefilter.wrappers.scene_source import SceneSource

ALONE = Scene.from_world([[0, 0]], [[0, 0]], 0.1)


class WithScene:
    def scene(self) -> Scene:
        return ALONE


class WithoutScene:
    scene = "a picture"


def test_environment_is_asked_for_its_scene() -> None:
    assert SceneSource(WithScene(), None)({}, {}) is ALONE


def test_function_goes_before_the_environment_and_is_told_the_latest() -> None:
    told: list[Any] = []

    def scene(*latest: Any) -> Scene:
        told.extend(latest)
        return Scene.from_world([[1, 1]], [[0, 0]], 0.1)

    env = WithScene()
    assert SceneSource(env, scene)("observation", {"key": 1}) is not ALONE
    assert told == [env, "observation", {"key": 1}]


def test_neither_is_an_error_that_says_what_to_do() -> None:
    with pytest.raises(
        SceneUnavailable, match=r"^WithoutScene has no scene\(\) method: .* or pass scene="
    ):
        SceneSource(WithoutScene(), None)


def test_what_is_no_scene_is_refused() -> None:
    source = SceneSource(WithScene(), lambda *_: {"position": [0, 0]})
    with pytest.raises(SceneUnavailable, match=r"expected a safefilter\.Scene, got dict"):
        source({}, {})

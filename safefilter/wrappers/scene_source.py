"""Where a wrapper gets scenes from: the environment's own ``scene()``, or a function of the user's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from safefilter.constraints.constraint import AnyScene
from safefilter.errors import SceneUnavailable
from safefilter.scene import Scene

SceneFunction: TypeAlias = Callable[[Any, Any, dict[str, Any]], AnyScene]
"""From (unwrapped environment, latest observation, latest info) to what the robots know now."""


class SceneSource:
    """Gives the scene of the present moment."""

    def __init__(
        self, env: object, scene: SceneFunction | None, *, has_robots: bool = True
    ) -> None:
        """Find out where scenes come from.

        Args:
            env: The unwrapped environment.
            scene: Function of the user's, or None for ``env.scene()``.
            has_robots: Must it be a `Scene`? For a `Box` of actions it is whatever the constraints read.

        Raises:
            SceneUnavailable: If there is neither.
        """
        if scene is None and not callable(getattr(env, "scene", None)):
            raise SceneUnavailable(
                f"{type(env).__name__} has no scene() method: give it one that returns a safefilter.Scene, or pass "
                "scene=, a function (env, observation, info) -> Scene"
            )
        self._env: Any = env
        self._scene = scene
        self._has_robots = has_robots

    def __call__(self, observation: object, info: dict[str, Any]) -> AnyScene:
        """Make the scene.

        Args:
            observation: The latest observation.
            info: The latest info.

        Raises:
            SceneUnavailable: If what comes back is no scene.
        """
        env, function = self._env, self._scene
        scene = env.scene() if function is None else function(env, observation, info)
        return require_scene(scene) if self._has_robots else scene


def require_scene(scene: object) -> Scene:
    """Check that what should be a scene is one.

    Raises:
        SceneUnavailable: If not.
    """
    if not isinstance(scene, Scene):
        raise SceneUnavailable(f"scene: expected a safefilter.Scene, got {type(scene).__name__}")
    return scene

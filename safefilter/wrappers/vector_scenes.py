"""Where a vector wrapper gets scenes from: the vector environment, its lanes, or a function of the user's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from safefilter.constraints.constraint import AnyScene
from safefilter.errors import SceneUnavailable, ShapeError
from safefilter.scene import Scene
from safefilter.wrappers.lanes import Lanes
from safefilter.wrappers.scene_source import require_scene


class VectorScenes:
    """Gives the scenes of the present moment, as one."""

    def __init__(
        self,
        env: Any,
        num_lanes: int,
        scene: Callable[[Any, Any, dict[str, Any]], AnyScene] | None,
        *,
        has_robots: bool,
    ) -> None:
        """Find out where scenes come from.

        Args:
            env: The unwrapped vector environment.
            num_lanes: How many environments it runs.
            scene: Function of the user's, or None for ``env.scene()``, or else ``env.call("scene")``.
            has_robots: Must they be `Scene`? For a `Box` of actions they are whatever the constraints read.

        Raises:
            SceneUnavailable: If there is none of these.
        """
        self._env, self._num_lanes = env, num_lanes
        self._scene, self._has_robots = scene, has_robots
        self._asks_lanes = not callable(getattr(env, "scene", None))
        if scene is None and self._asks_lanes and not _lanes_have_scenes(env):
            raise SceneUnavailable(
                f"{type(env).__name__} has no scene() method, and not all of its environments have one: give them one "
                "that returns a safefilter.Scene, or pass scene=, a function (vector_env, observations, infos) -> "
                "scenes"
            )

    def __call__(self, observations: object, infos: dict[str, Any]) -> Lanes:
        """Make the scenes.

        Args:
            observations: The latest observations.
            infos: The latest infos.

        Raises:
            SceneUnavailable: If what comes back is no scene, nor a scene a lane.
            ShapeError: If there are more or less scenes, or robots, than lanes.
        """
        found = self._found(observations, infos)
        if not self._has_robots:
            return Lanes.of_entries(found, self._num_lanes)
        if isinstance(found, Scene):
            robots = getattr(self._env, "robot_of_lane", None)
            if robots is not None:
                return Lanes.of_robots(found, robots, self._num_lanes)
            return Lanes.of_worlds(found, self._num_lanes)
        if not isinstance(found, list | tuple):
            raise SceneUnavailable(
                "scene: expected a list of safefilter.Scene, one an environment, or one Scene for all with world=; "
                f"got {type(found).__name__}"
            )
        if len(found) != self._num_lanes:
            raise ShapeError(
                f"scene: expected {self._num_lanes} scenes, one an environment, got {len(found)}"
            )
        return Lanes.stacked([require_scene(scene) for scene in found])

    def _found(self, observations: object, infos: dict[str, Any]) -> AnyScene:
        if self._scene is not None:
            return self._scene(self._env, observations, infos)
        return self._env.call("scene") if self._asks_lanes else self._env.scene()


def _lanes_have_scenes(env: Any) -> bool:
    return callable(getattr(env, "call", None)) and all(env.call("has_wrapper_attr", "scene"))

"""An environment with a filter in it, driven step by step with an eye on what it promises.

Works on Gymnasium environments of one robot or of many, and on parallel PettingZoo environments: actions are rows, one
an agent.

Letters: R rows, d numbers a row, N robots. m.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.closest_approach import Approach, Pairs, pairs_within
from safefilter.decision import Case, Fault
from safefilter.errors import InvalidInput
from safefilter.scene import Scene
from safefilter.testing.invariants import Collision, NotCertified
from safefilter.testing.minimality import NotMinimal
from safefilter.testing.paths import Paths, robots_on_paths, walls_on_paths
from safefilter.wrappers.scene_source import SceneFunction, SceneSource

Judge = Literal["straight", "arcs", "ends"]
Action: TypeAlias = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """What to look at; see `closed_loop`, whose arguments these are."""

    make_env: Callable[[], Any]
    make_filter: Callable[[Any], Any]
    truth: SceneFunction | None
    clearance: Callable[[Any], float] | None
    judge: Judge
    options: Mapping[str, Any] | None


class JudgedEnv:
    """One environment, from one `reset` to the next.

    Attributes:
        env: The environment with the filter around it.
        low: Least action, shape (R, d).
        high: Largest action, shape (R, d).
        dtype: Of the action space.
        is_over: Has the episode ended?
    """

    def __init__(self, settings: LoopSettings) -> None:
        """Make it.

        Raises:
            InvalidInput: If there is nothing that could be judged, or actions are no Box.
        """
        self._settings = settings
        self.env = settings.make_filter(settings.make_env())
        self._agents = list(getattr(self.env, "possible_agents", ()))
        spaces = [self.env.action_space(agent) for agent in self._agents]
        spaces = spaces or [self.env.action_space]
        if not all(hasattr(space, "low") for space in spaces):
            raise InvalidInput(f"action_space: expected a Box, got {spaces[0]}")
        self._shape = spaces[0].shape
        ends = [np.stack([getattr(space, end) for space in spaces]) for end in ("low", "high")]
        self.low, self.high = (end.reshape(-1, self._shape[-1]) for end in ends)
        self.dtype = spaces[0].dtype
        inner = self.env.unwrapped
        has_scene = settings.truth is not None or callable(getattr(inner, "scene", None))
        if not has_scene and settings.clearance is None:
            raise InvalidInput(
                f"truth: {type(inner).__name__} has no scene() method; pass truth=, a function "
                "(env, observation, info) -> Scene, or clearance=, a function of the environment"
            )
        self._scene = SceneSource(inner, settings.truth) if has_scene else None
        self.is_over = True
        self._number = 0
        self._before: Scene | None = None
        self._clearance = 0.0

    def reset(self, seed: int) -> None:
        """Start an episode."""
        options = None if self._settings.options is None else dict(self._settings.options)
        observation, info = self.env.reset(seed=seed, options=options)
        self._number, self.is_over = 0, False
        self._look(observation, info)

    @property
    def scene(self) -> Scene | None:
        """Where everybody is, or None if that is not looked at."""
        return self._before

    def step(self, rows: Action) -> None:
        """Make a step, and check it.

        Args:
            rows: Actions asked for, shape (R, d).

        Raises:
            NotCertified: If something executed that is not certified, or nothing was filtered.
            NotMinimal: If a safe action did not come back bit for bit.
            Collision: If two robots, or a robot and a wall, came into contact, or the clearance fell below zero.
        """
        asked = rows.astype(self.dtype)
        observation, info, told = self._execute(asked)
        for row, numbers in enumerate(told):
            self._check_row(row, asked[row], numbers)
        before, clearance = self._before, self._clearance
        self._look(observation, info)
        if before is not None and self._before is not None:
            self._check_scenes(before, self._before)
        if self._clearance < 0.0 <= clearance:
            raise Collision(
                f"in step {self._number} the clearance falls from {clearance:.6g} to {self._clearance:.6g}"
            )
        self._number += 1

    def close(self) -> None:
        """Close it."""
        self.env.close()

    def _execute(self, asked: Action) -> tuple[Any, Any, list[Mapping[str, Any]]]:
        """Step; returns observation, info, and what the filter tells of each row."""
        if self._agents:
            acts = [agent in self.env.agents for agent in self._agents]
            given = {agent: asked[row] for row, agent in enumerate(self._agents) if acts[row]}
            observation, _, _, _, info = self.env.step(given)
            told = [
                self._told(info.get(agent, {}), None) if acts[row] else {}
                for row, agent in enumerate(self._agents)
            ]
            self.is_over = not self.env.agents
            return observation, info, told
        observation, _, terminated, truncated, info = self.env.step(asked.reshape(self._shape))
        self.is_over = bool(terminated or truncated)
        rows = [None] if len(self._shape) == 1 else list(range(len(asked)))
        return observation, info, [self._told(info, row) for row in rows]

    def _told(self, info: Mapping[str, Any], row: int | None) -> Mapping[str, Any]:
        if "safefilter" not in info:
            raise NotCertified(
                f'step {self._number}: info holds no "safefilter": make_filter must put SafeAction or SafeParallelEnv '
                "around the environment"
            )
        numbers = info["safefilter"]
        return numbers if row is None else {key: value[row] for key, value in numbers.items()}

    def _check_row(self, row: int, asked: Action, told: Mapping[str, Any]) -> None:
        # 0: nothing was decided, because somebody does not cooperate, or is done.
        if not told or told["case"] == 0:
            return
        if not told["certified"]:
            raise NotCertified(
                f"row {row} in step {self._number}: {told['action'].tolist()} executes and is not certified, "
                f"fault {Fault(int(told['fault'])).name}, asked for {asked.tolist()}"
            )
        is_untouched = told["case"] == Case.SAFE and told["fault"] == Fault.NONE
        if is_untouched and np.asarray(told["action"], asked.dtype).tobytes() != asked.tobytes():
            raise NotMinimal(
                f"row {row} in step {self._number}: {asked.tolist()} is safe, but {told['action'].tolist()} executes"
            )

    def _look(self, observation: Any, info: Any) -> None:
        if self._scene is not None:
            self._before = self._scene(observation, info)
        if self._settings.clearance is not None:
            self._clearance = float(self._settings.clearance(self.env.unwrapped))

    def _check_scenes(self, before: Scene, after: Scene) -> None:
        """Judge what happened between two scenes.

        Raises:
            Collision: At a contact of robots that were apart, one of them cooperative, or of a cooperative one and a
                wall.
        """
        if before.num_robots != after.num_robots:
            return
        paths = _paths(before, after, self._settings.judge)
        pairs = pairs_within(before.world)
        matters = before.cooperative[pairs.first] | before.cooperative[pairs.second]
        pairs = Pairs(pairs.first[matters], pairs.second[matters])
        approach = robots_on_paths(paths, before.radius, pairs)
        if approach.collided.any():
            k, how = self._deepest(approach)
            raise Collision(f"robots {pairs.first[k]} and {pairs.second[k]} {how}")
        walls = before.walls[: before.num_shared_walls, :4].reshape(-1, 2, 2)
        robots = np.flatnonzero(before.cooperative)
        pairs = Pairs(np.repeat(robots, len(walls)), np.tile(np.arange(len(walls)), len(robots)))
        approach = walls_on_paths(paths, before.radius, walls, pairs)
        if approach.collided.any():
            k, how = self._deepest(approach)
            ends = walls[pairs.second[k]].tolist()
            raise Collision(
                f"robot {pairs.first[k]} and the wall from {ends[0]} to {ends[1]} m {how}"
            )

    def _deepest(self, approach: Approach) -> tuple[int, str]:
        least = np.where(approach.collided, approach.least, np.inf)
        k = int(least.argmin())
        return k, (
            f"collide in step {self._number}: clearance {1e3 * least[k]:.6g} mm at {approach.fraction[k]:.3f} of the "
            f"step, from {1e3 * approach.start[k]:.6g} mm"
        )


def _paths(before: Scene, after: Scene, judge: Judge) -> Paths:
    turn: FloatArray = np.zeros(before.num_robots)
    if judge == "ends":
        return Paths(after.position, np.zeros_like(after.position), turn)
    if judge == "arcs" and before.heading is not None and after.heading is not None:
        turned = after.heading - before.heading
        turn = (turned + np.pi) % (2.0 * np.pi) - np.pi
    return Paths(before.position, after.position - before.position, turn)

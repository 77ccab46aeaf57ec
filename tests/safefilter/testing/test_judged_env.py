"""Each promise that an environment with a filter can break is told; one that breaks none is driven to its end."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from envs.pettingzoo_adapter import ParallelRobots
from safefilter.errors import InvalidInput
from safefilter.testing.invariants import Collision, NotCertified
from safefilter.testing.judged_env import JudgedEnv, LoopSettings
from safefilter.testing.minimality import NotMinimal
from safefilter.wrappers import SafeAction
from safefilter.wrappers.pettingzoo_wrapper import SafeParallelEnv

Action = npt.NDArray[np.floating]
DT = 0.2


class Square(gymnasium.Env[Action, Action]):
    """Two robots, 1 m between their rims, and a wall above the first."""

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2, 2))
    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (2, 2))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Action, dict[str, Any]]:
        super().reset(seed=seed)
        self.options, self.steps = options, 0
        self.position = np.array([[0.0, 0.0], [1.4, 0.0]])
        return self.position.copy(), {}

    def step(self, action: Action) -> tuple[Action, float, bool, bool, dict[str, Any]]:
        self.position = self.position + DT * self.executed(action.astype(np.float64))
        self.steps += 1
        return self.position.copy(), 0.0, False, self.steps == 9, {}

    def executed(self, action: Action) -> Action:
        return action

    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(
            self.position, np.zeros((2, 2)), 0.2, walls=[[[-1.0, 0.5], [1.0, 0.5]]]
        )


def filtered(env: Any) -> Any:
    safety_filter = sf.SafetyFilter([sf.Separation(DT)], sf.Holonomic(1.0))
    return SafeAction(env, safety_filter, index=None)


def judged(
    make_env: Callable[[], Any] = Square,
    make_filter: Callable[[Any], Any] = filtered,
    **others: Any,
) -> JudgedEnv:
    settings = {"truth": None, "clearance": None, "judge": "straight", "options": None, **others}
    env = JudgedEnv(LoopSettings(make_env, make_filter, **settings))
    env.reset(0)
    return env


def keep_on(env: JudgedEnv, action: Action) -> None:
    while not env.is_over:
        env.step(action)


TOGETHER = np.array([[1.0, 0.0], [-1.0, 0.0]])
UP = np.array([[0.0, 1.0], [0.0, 0.0]])


class Slipping(Square):
    """Executes twice what it is told."""

    def executed(self, action: Action) -> Action:
        return 2.0 * action


def test_a_filter_that_keeps_its_promises_is_driven_to_the_end() -> None:
    env = judged(options={"for": "you"})
    assert env.env.unwrapped.options == {"for": "you"}
    for _ in range(9):
        assert not env.is_over
        env.step(TOGETHER + UP)
    assert env.is_over
    env.close()


def test_a_collision_of_robots_is_told_with_step_and_clearance() -> None:
    env = judged(Slipping)
    with pytest.raises(Collision, match="robots 0 and 1 collide in step 1: clearance -") as caught:
        keep_on(env, TOGETHER)
    assert "mm at " in str(caught.value)
    assert " of the step, from 200 mm" in str(caught.value)


def test_a_collision_with_a_wall_is_told() -> None:
    env = judged(Slipping)
    told = r"robot 0 and the wall from \[-1\.0, 0\.5\] to \[1\.0, 0\.5\] m collide in step 0"
    with pytest.raises(Collision, match=told):
        env.step(UP)


def test_ends_alone_are_judged_where_that_is_asked_for() -> None:
    class Passing(Square):
        def executed(self, action: Action) -> Action:
            return 7.0 * action

    # They change places in one step.
    judged(Passing, judge="ends").step(TOGETHER)
    with pytest.raises(Collision, match="robots 0 and 1 collide in step 0"):
        judged(Passing).step(TOGETHER)


def test_a_clearance_of_your_own_is_watched() -> None:
    def above_ground(env: Square) -> float:
        return float(env.position[1, 1]) + 0.3

    env = judged(clearance=above_ground)
    env.step(np.array([[0.0, 0.0], [0.0, -1.0]]))
    with pytest.raises(Collision, match=r"in step 1 the clearance falls from 0\.1 to -0\.1"):
        env.step(np.array([[0.0, 0.0], [0.0, -1.0]]))


class Altered(gymnasium.Wrapper[Action, Action, Action, Action]):
    """Tells something else than what happened."""

    field, value = "certified", np.array([True, False])

    def step(self, action: Action) -> tuple[Action, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        info["safefilter"] = {**info["safefilter"], self.field: self.value}
        return observation, reward, terminated, truncated, info


def test_what_is_not_certified_is_told() -> None:
    env = judged(make_filter=lambda env: Altered(filtered(env)))
    with pytest.raises(NotCertified, match=r"row 1 in step 0: .* is not certified, fault NONE"):
        env.step(UP)


def test_a_safe_action_that_was_changed_is_told() -> None:
    class Nudged(Altered):
        field, value = "action", np.full((2, 2), 0.25)

    env = judged(make_filter=lambda env: Nudged(filtered(env)))
    with pytest.raises(NotMinimal, match=r"row 0 in step 0: \[0\.0, 0\.0\] is safe, but"):
        env.step(np.zeros((2, 2)))


def test_an_environment_without_a_filter_is_told() -> None:
    env = judged(make_filter=lambda env: env)
    with pytest.raises(NotCertified, match="make_filter must put SafeAction or SafeParallelEnv"):
        env.step(UP)


def test_pettingzoo_is_driven_agent_by_agent() -> None:
    safety_filter = sf.SafetyFilter([sf.Separation(DT)], sf.Holonomic(0.2))
    env = judged(
        lambda: ParallelRobots("crossroad"), lambda env: SafeParallelEnv(env, safety_filter)
    )
    assert env.low.shape == env.high.shape == (8, 2)
    for _ in range(3):
        env.step(env.high)
    assert env.scene is not None
    assert env.scene.num_robots >= 8


def test_the_truth_may_come_from_elsewhere() -> None:
    def truth(env: Square, _observation: Action, _info: object) -> sf.Scene:
        # The second robot is larger than the filter thinks.
        return sf.Scene.from_world(env.position, np.zeros((2, 2)), [0.2, 0.5])

    env = judged(truth=truth)
    with pytest.raises(Collision, match="robots 0 and 1"):
        keep_on(env, TOGETHER)


def test_what_cannot_be_judged_is_refused() -> None:
    class Blind(Square):
        scene = None  # type: ignore[assignment]  # as if it had none

    with pytest.raises(InvalidInput, match=r"truth: Blind has no scene\(\) method; pass truth="):
        judged(Blind, lambda env: env)
    with pytest.raises(InvalidInput, match="action_space: expected a Box, got Discrete"):
        judged(lambda: gymnasium.make("CartPole-v1"), lambda env: env)

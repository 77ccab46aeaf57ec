"""A stateful test of an environment of yours with a filter of yours in it.

::

    TestMyRobots = closed_loop(make_env, lambda env: SafeAction(env, safety_filter)).TestCase

Hypothesis drives it: seeds, actions to the corners of the action space, in between and beyond sense, robots that ram
each other. A failure is shrunk to few steps of round numbers, and comes with the code that repeats it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, get_args

import numpy as np
import numpy.typing as npt
from hypothesis import HealthCheck, note, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from safefilter.errors import InvalidInput
from safefilter.scene import Scene
from safefilter.testing.judged_env import Judge, JudgedEnv, LoopSettings
from safefilter.testing.policies import Ramming
from safefilter.wrappers.scene_source import SceneFunction

MAX_SEED = 99
EXAMPLES, STEPS = 20, 20
# Steps are as slow as your environment is.
QUICK = settings(
    max_examples=EXAMPLES,
    stateful_step_count=STEPS,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)

Rows = list[list[float]]


class ClosedLoop(RuleBasedStateMachine):
    """A machine that `closed_loop` has filled in."""

    loop: ClassVar[LoopSettings]

    @classmethod
    def replay(cls, seed: int, actions: Sequence[Rows]) -> None:
        """Make the steps of a failure again, with all checks.

        Args:
            seed: Seed of the episode.
            actions: What was asked for in each step, shape (R, d).

        Raises:
            AssertionError: If the failure is still there; see `JudgedEnv.step`.
        """
        env = JudgedEnv(cls.loop)
        env.reset(seed)
        try:
            for rows in actions:
                env.step(np.array(rows))
        finally:
            env.close()


def closed_loop(
    make_env: Callable[[], Any],
    make_filter: Callable[[Any], Any],
    *,
    truth: SceneFunction | None = None,
    clearance: Callable[[Any], float] | None = None,
    judge: Judge = "straight",
    options: Mapping[str, Any] | None = None,
    asks_nan: bool = True,
) -> type[ClosedLoop]:
    """Make a state machine: whatever the policy asks for, nobody collides, and all that executes is certified.

    In each step: what executes is certified; a safe action comes back bit for bit; robots that cooperate touch neither
    each other, nor others, nor a wall, if they did not before; the clearance stays at or above zero.

    Args:
        make_env: Makes the bare environment: Gymnasium, of one robot or many, or PettingZoo's parallel kind.
        make_filter: From an environment to one with the filter around it, by `SafeAction` or `SafeParallelEnv`.
        truth: Function ``(env, observation, info) -> Scene`` of the unwrapped environment: where everybody really is.
            None: its method ``scene()``, if it has one. If your filter takes its scene from a sensor, this should not.
        clearance: For what is no matter of robots: a function of the unwrapped environment that is negative where harm
            is done.
        judge: How robots get from one scene to the next: "straight", in "arcs" by the change of their headings, or
            "ends" to look at the scenes alone, for environments that put robots elsewhere or take many small steps.
        options: Handed to ``reset``.
        asks_nan: Does the policy ask for NaN at times? A filter of a `Box` without fallback refuses that.

    Returns:
        A state machine of Hypothesis: its ``TestCase`` is for pytest and unittest, and
        ``hypothesis.stateful.run_state_machine_as_test`` runs it. Settings: `QUICK`, or ``TestCase.settings``.

    Raises:
        InvalidInput: If there is nothing to judge, the judge is another, or actions are no Box.
    """
    if judge not in get_args(Judge):
        raise InvalidInput(f"judge: expected one of {', '.join(get_args(Judge))}, got {judge!r}")
    loop_settings = LoopSettings(make_env, make_filter, truth, clearance, judge, options)
    first = JudgedEnv(loop_settings)
    actions = _rows_between(first.low, first.high, asks_nan=asks_nan)
    first.close()

    class Machine(ClosedLoop):
        loop = loop_settings

        def __init__(self) -> None:
            super().__init__()
            self._env = JudgedEnv(loop_settings)
            self._seed, self._asked = 0, list[Rows]()

        @initialize(seed=st.integers(0, MAX_SEED))
        def reset(self, seed: int) -> None:
            self._seed, self._asked = seed, []
            self._env.reset(seed)

        @rule(action=actions)
        def step(self, action: Rows) -> None:
            self._step(action)

        @rule()
        def ram(self) -> None:
            """Everybody at the nearest other, at full speed."""
            low, high = self._env.low, self._env.high
            self._step(np.clip(_ramming(self._env.scene, high), low, high).tolist())

        def _step(self, rows: Rows) -> None:
            if self._env.is_over:
                self.reset(self._seed + 1)
            self._asked.append(rows)
            try:
                self._env.step(np.array(rows))
            except AssertionError as failure:
                code = f"closed_loop(...).replay({self._seed}, {_code(self._asked)})"
                note(f"to repeat it: {code}")
                failure.args = (
                    f"{failure}\nto repeat it, with the arguments of this loop:\n  {code}",
                )
                raise

        def teardown(self) -> None:
            self._env.close()

    Machine.TestCase.settings = QUICK
    return Machine


def _code(actions: list[Rows]) -> str:
    return repr(actions).replace("nan", "np.nan")


def _rows_between(
    low: npt.NDArray[np.floating], high: npt.NDArray[np.floating], *, asks_nan: bool
) -> st.SearchStrategy[Rows]:
    """Rows of actions: standing still, ends, corners, and anything in between."""

    def number(least: float, most: float) -> st.SearchStrategy[float]:
        still = min(max(0.0, least), most)
        # Spaces are float32 as a rule, and their ends must be hit, not passed.
        ends = st.sampled_from((still, most, least, *((float("nan"),) if asks_nan else ())))
        return ends | st.floats(least, most, width=32)

    rows = [
        st.tuples(*map(number, a, b)).map(list)
        for a, b in zip(low.tolist(), high.tolist(), strict=True)
    ]
    return st.tuples(*rows).map(list)


def _ramming(scene: Scene | None, high: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """Full speed at the nearest robot: velocities where robots have no heading, commands where they have."""
    if scene is None or high.shape[1] != 2 or scene.num_robots < len(high):
        return high
    speed = np.full(scene.num_robots, float(high[:, 0].max()))
    wanted = Ramming().act(scene, speed, np.random.default_rng(0))[: len(high)]
    if scene.heading is None:
        return wanted
    turn = np.arctan2(wanted[:, 1], wanted[:, 0]) - scene.heading[: len(high)]
    turn_rate = ((turn + np.pi) % (2.0 * np.pi) - np.pi) * 10.0
    return np.stack([speed[: len(high)], turn_rate], axis=1)

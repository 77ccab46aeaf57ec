"""A state machine finds what breaks a promise, shrinks it, and says how to repeat it."""

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test

import safefilter as sf
from safefilter.errors import InvalidInput
from safefilter.testing.closed_loop import closed_loop
from safefilter.testing.invariants import Collision
from safefilter.wrappers import SafeAction

Action = npt.NDArray[np.floating]
FEW = settings(max_examples=5, stateful_step_count=8, deadline=None)


class Street(gymnasium.Env[Action, Action]):
    """A robot, and a parked one ahead."""

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (2,))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Action, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.position, self.heading = np.zeros(2), 0.0
        return self.position.copy(), {}

    def step(self, action: Action) -> tuple[Action, float, bool, bool, dict[str, Any]]:
        self.position = self.position + 0.2 * action.astype(np.float64)
        return self.position.copy(), 0.0, bool(self.position[1] > 1.5), False, {}

    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(
            np.array([self.position, [1.0, 0.0]]), np.zeros((2, 2)), 0.2, cooperative=[True, False]
        )


def careful(env: Any) -> Any:
    return SafeAction(env, sf.SafetyFilter([sf.Separation(0.2)], sf.Holonomic(1.0)))


def hasty(env: Any) -> Any:
    """Thinks that a step takes a tenth of its time."""
    return SafeAction(env, sf.SafetyFilter([sf.Separation(0.02)], sf.Holonomic(1.0)))


def test_a_careful_filter_passes() -> None:
    run_state_machine_as_test(closed_loop(Street, careful), settings=FEW)


def test_a_hasty_one_is_found_and_the_message_repeats_it() -> None:
    loop = closed_loop(Street, hasty)
    with pytest.raises(Collision, match="robots 0 and 1 collide in step ") as caught:
        run_state_machine_as_test(loop, settings=settings(FEW, max_examples=50))
    code = str(caught.value).splitlines()[-1].strip()
    assert code.startswith("closed_loop(...).replay(0, [[[")
    # Three steps of 0.2 m end in front of the other robot's rim: a fourth is all it takes.
    assert code.count("]]") <= 5
    with pytest.raises(Collision) as again:
        exec(code.replace("closed_loop(...)", "loop"), {"loop": loop, "np": np})
    assert str(again.value) == str(caught.value).split("\n", maxsplit=1)[0]


def test_a_failure_that_is_gone_replays_in_silence() -> None:
    closed_loop(Street, careful).replay(0, [[[1.0, 0.0]]] * 5)


def test_drives_are_judged_on_arcs_and_ram_by_turning() -> None:
    class Rover(Street):
        action_space = gymnasium.spaces.Box(
            np.array([0.0, -1.5], np.float32), np.array([1.0, 1.5], np.float32)
        )

        def step(self, action: Action) -> tuple[Action, float, bool, bool, dict[str, Any]]:
            v, w = action.astype(np.float64)
            half = 0.1 * w
            course = self.heading + half
            chord = 0.2 * v * np.sinc(half / np.pi) * np.array([np.cos(course), np.sin(course)])
            self.position, self.heading = self.position + chord, self.heading + 2.0 * half
            return self.position.copy(), 0.0, False, False, {}

        def scene(self) -> sf.Scene:
            return sf.Scene.from_world(
                np.array([self.position, [1.0, 0.0]]),
                np.zeros((2, 2)),
                0.2,
                heading=[self.heading, 0.0],
                cooperative=[True, False],
            )

    drive = sf.DifferentialDrive(1.0, 1.5, 0.2, 0.05)
    safety_filter = sf.SafetyFilter([sf.Separation(0.2)], drive)
    loop = closed_loop(Rover, lambda env: SafeAction(env, safety_filter), judge="arcs")
    run_state_machine_as_test(loop, settings=FEW)


def test_it_is_a_test_case_for_pytest() -> None:
    case = closed_loop(Street, careful).TestCase
    case.settings = settings(FEW, max_examples=2)
    case("runTest").runTest()


def test_a_judge_that_does_not_exist_is_refused() -> None:
    with pytest.raises(InvalidInput, match="judge: expected one of straight, arcs, ends, got 'x'"):
        closed_loop(Street, careful, judge="x")  # type: ignore[arg-type]  # the mistake

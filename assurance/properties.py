"""What filters are held against here: the shipped checks of `safefilter.testing`, each over inputs of its kind.

A property draws one input and checks it; `first_failure` counts how many it takes until one fails.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky
from hypothesis.stateful import run_state_machine_as_test

import safefilter as sf
from safefilter.kinematics.differential_drive import Mapping
from safefilter.testing import (
    CONTRACT_TOLERANCE,
    Trial,
    actions,
    assert_backends_agree,
    assert_certified,
    assert_collision_free,
    assert_minimal,
    assert_priority_allocation,
    assert_smallest_change,
    assert_tracked,
    backend_contract,
    closed_loop,
    crowded,
    degenerate,
    head_on,
    rollouts,
    scenes,
    touching,
    walls,
)
from safefilter.testing.closed_loop import QUICK
from safefilter.wrappers import SafeAction

DT, TAU, V_MAX = 0.2, 2.0, 1.0
# Sides of the speed polygon: few, because kernels are interpreted here.
SIDES = 12
MOST_EXAMPLES = 300
SEED = 20261125


@dataclass(frozen=True, slots=True)
class Property:
    """A check of `safefilter.testing`.

    Attributes:
        name: Of the check.
        check: Draws one input, and raises AssertionError if the filter is wrong on it.
    """

    name: str
    check: Callable[[st.DataObject], None]


@dataclass(frozen=True, slots=True)
class Catch:
    """How a wrong filter was caught.

    Attributes:
        examples: Inputs drawn until then.
        message: First line of what the check says.
    """

    examples: int
    message: str


def first_failure(prop: Property, most_examples: int = MOST_EXAMPLES) -> Catch | None:
    """Draw inputs until the check fails; None if it does not."""
    if prop is LOOP:
        return _first_failing_episode(most_examples)
    examples, found = 0, list[Catch]()

    @seed(SEED)
    @settings(
        max_examples=most_examples,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def run(data: st.DataObject) -> None:
        nonlocal examples
        examples += 1
        try:
            prop.check(data)
        except AssertionError as failure:
            found.append(Catch(examples, str(failure).split("\n", maxsplit=1)[0]))
            raise

    # Hypothesis repeats the failure before it reports it; a bug that remembers may then not fail again.
    with contextlib.suppress(AssertionError, Flaky):
        run()
    return found[0] if found else None


def holonomic(v_max: npt.ArrayLike = V_MAX, *, backend: str = "planar") -> sf.SafetyFilter:
    """The filter that is tested."""
    return sf.SafetyFilter(
        [sf.PriorityORCA(TAU), sf.Separation(DT)],
        sf.Holonomic(np.asarray(v_max), SIDES),
        backend=backend,
    )


def _filter_of(trial: Trial) -> sf.SafetyFilter:
    kinematics = (
        sf.DifferentialDrive(trial.v_max, trial.omega_max, trial.dt, 0.05, sides=SIDES)
        if trial.is_driving
        else sf.Holonomic(trial.v_max, SIDES)
    )
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    return sf.SafetyFilter([sf.PriorityORCA(TAU), separation], kinematics)


def _collision_free(data: st.DataObject) -> None:
    trial = data.draw(rollouts(st.one_of(scenes(), touching(), crowded())))
    assert_collision_free(_filter_of(trial), trial)


def _collision_free_among_walls(data: st.DataObject) -> None:
    trial = data.draw(rollouts(walls()))
    assert_collision_free(_filter_of(trial), trial)


def _collision_free_on_arcs(data: st.DataObject) -> None:
    trial = data.draw(rollouts(st.one_of(scenes(), walls()), omega_max=6.0))
    assert_collision_free(_filter_of(trial), trial)


def _decided(
    data: st.DataObject, starts: st.SearchStrategy[sf.Scene]
) -> tuple[sf.SafetyFilter, sf.Scene, npt.NDArray[np.floating]]:
    scene = data.draw(starts)
    action = data.draw(actions(scene))[scene.cooperative]
    dtype = data.draw(st.sampled_from((np.float64, np.float32)))
    return holonomic(), scene, action.astype(dtype)


def _certified(data: st.DataObject) -> None:
    safety_filter, scene, action = _decided(data, st.one_of(scenes(), crowded(), degenerate()))
    decision = safety_filter.decide(scene, action)
    assert_certified(safety_filter, scene, action, decision)


def _minimal(data: st.DataObject) -> None:
    safety_filter, scene, action = _decided(data, st.one_of(scenes(), crowded(), head_on()))
    assert_minimal(safety_filter, scene, action, safety_filter.decide(scene, action))


def _allocation(data: st.DataObject) -> None:
    scene = data.draw(st.one_of(scenes(), head_on(), degenerate()))
    wanted = scene.velocity if scene.wanted is None else scene.wanted
    assert_priority_allocation(holonomic(), scene, wanted[scene.cooperative], v_opt=scene.velocity)


def _smallest_change(data: st.DataObject) -> None:
    scene = data.draw(st.one_of(scenes(), head_on()))
    assert_smallest_change(
        holonomic(),
        scene,
        scene.velocity[scene.cooperative],
        v_opt=scene.velocity,
        time_horizon=TAU,
    )


def _tracked(data: st.DataObject) -> None:
    error = data.draw(st.sampled_from((0.01, 0.05)))
    mapping: Mapping = data.draw(st.sampled_from(("cut", "polygon")))
    assert_tracked(sf.DifferentialDrive(V_MAX, 3.0, DT, error, mapping=mapping))


def _backends_agree(data: st.DataObject) -> None:
    _, scene, action = _decided(data, st.one_of(crowded(), head_on()))

    def make_filter(backend: str) -> sf.SafetyFilter:
        return holonomic(backend=backend)

    answered = assert_backends_agree(make_filter, scene, action, backends=("planar", "clarabel"))
    # A backend that nothing is taken from agrees with whatever stands in for it.
    if answered["planar"] > answered["clarabel"]:
        raise AssertionError(f"answers of clarabel are refused: {answered}")


def _contract(_data: st.DataObject) -> None:
    backend_contract(lambda: sf.make_backend("osqp", tolerance=CONTRACT_TOLERANCE))


Action = npt.NDArray[np.floating]


class Street(gymnasium.Env[Action, Action]):
    """Two robots less than a metre apart, for the wrapper."""

    action_space = gymnasium.spaces.Box(-V_MAX, V_MAX, (2, 2))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2, 2))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Action, dict[str, Any]]:
        """Put them down."""
        super().reset(seed=seed, options=options)
        self.position = np.array([[0.0, 0.0], [1.0, 0.1]])
        self.velocity = np.zeros((2, 2))
        return self.position.copy(), {}

    def step(self, action: Action) -> tuple[Action, float, bool, bool, dict[str, Any]]:
        """Move them."""
        self.velocity = action.astype(np.float64)
        self.position = self.position + DT * self.velocity
        return self.position.copy(), 0.0, False, False, {}

    def scene(self) -> sf.Scene:
        """Where they are."""
        return sf.Scene.from_world(self.position, self.velocity, 0.2)


def _closed_loop(_data: st.DataObject) -> None:
    catch = _first_failing_episode(1)
    if catch is not None:
        raise AssertionError(catch.message)


def _first_failing_episode(most_examples: int) -> Catch | None:
    """Let the state machine drive episodes until one fails."""
    episodes = 0

    def make_env() -> Street:
        nonlocal episodes
        episodes += 1
        return Street()

    loop = closed_loop(make_env, lambda env: SafeAction(env, holonomic(), index=None))
    episodes = 0
    try:
        run_state_machine_as_test(
            loop,
            settings=settings(
                QUICK, max_examples=most_examples, derandomize=True, phases=[Phase.generate]
            ),
        )
    except AssertionError as failure:
        return Catch(episodes, str(failure).split("\n", maxsplit=1)[0])
    return None


COLLISION_FREE = Property("assert_collision_free", _collision_free)
WALLS = Property("assert_collision_free, walls", _collision_free_among_walls)
ARCS = Property("assert_collision_free, arcs", _collision_free_on_arcs)
CERTIFIED = Property("assert_certified", _certified)
MINIMAL = Property("assert_minimal", _minimal)
ALLOCATION = Property("assert_priority_allocation", _allocation)
SMALLEST_CHANGE = Property("assert_smallest_change", _smallest_change)
TRACKED = Property("assert_tracked", _tracked)
AGREE = Property("assert_backends_agree", _backends_agree)
CONTRACT = Property("backend_contract", _contract)
LOOP = Property("closed_loop", _closed_loop)
PROPERTIES = (
    COLLISION_FREE, WALLS, ARCS, CERTIFIED, MINIMAL, ALLOCATION, SMALLEST_CHANGE, TRACKED, AGREE, CONTRACT, LOOP,
)  # fmt: skip

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from safefilter import (
    DifferentialDrive,
    Holonomic,
    PriorityORCA,
    SafetyFilter,
    Scene,
    Separation,
    Uncertainty,
)
from safefilter.arrays import FloatArray
from safefilter.closest_approach import CONTACT_TOLERANCE
from safefilter.testing.policies import GoalSeeking, Policy, Ramming, UniformRandom
from safefilter.testing.strategies import scenes
from safefilter.testing.uncertain_loop import (
    SIDES,
    Adversary,
    AtRandom,
    Errors,
    UncertainTrial,
    roll_out_uncertain,
)

DT = 0.2
# Apart by more than the safety margin at the start: what is certain later must be so then.
LEAST_GAP = 2e-6


def some(most: float) -> st.SearchStrategy[float]:
    return st.just(0.0) | st.sampled_from((most, most / 4)) | st.floats(0.0, most)


@st.composite
def uncertainties(draw: st.DrawFn) -> Uncertainty:
    return Uncertainty(
        position_error=draw(some(0.06)),
        heading_error=draw(some(0.2)),
        velocity_error=draw(some(0.3)),
        observation_delay=draw(some(0.3)),
        actuation_delay=draw(some(0.3)),
        clock_jitter=draw(some(0.2)),
        lost_messages=draw(st.sampled_from((0, 0, 1, 2))),
        actuation_error=draw(some(0.4)),
    )


@st.composite
def worlds(draw: st.DrawFn) -> Scene:
    """Two to four robots, at most one of which does not cooperate, and perhaps a wall beside them."""
    found = draw(
        scenes(st.integers(2, 4), st.sampled_from((0.3, 0.05, 1e-3)), cooperative=st.just(True))
    )
    position = found.position * 1.001 + 0.0
    cooperative = np.full(found.num_robots, fill_value=True)
    cooperative[-1] = found.num_robots == 2 or draw(st.booleans())
    velocity = np.where(cooperative[:, None], 0.0, found.velocity)
    walls = None
    if draw(st.booleans()):
        lowest = float((position[:, 1] - found.radius).min()) - draw(st.sampled_from((0.001, 0.1)))
        walls = [[[-0.3, lowest], [draw(st.sampled_from((0.0, 1.0))), lowest]]]
    return Scene.from_world(
        position,
        velocity,
        found.radius,
        heading=draw(
            st.lists(st.floats(-3.0, 3.0), min_size=len(velocity), max_size=len(velocity))
        ),
        priority=found.priority,
        cooperative=cooperative,
        walls=walls,
    )


def is_apart(scene: Scene) -> bool:
    offset = scene.position[:, None] - scene.position
    gap = np.hypot(offset[..., 0], offset[..., 1]) - scene.radius[:, None] - scene.radius
    return bool((gap[np.triu_indices(len(gap), k=1)] > LEAST_GAP).all())


def least(safety_filter: SafetyFilter, trial: UncertainTrial) -> tuple[float, float]:
    steps = list(roll_out_uncertain(safety_filter, trial))
    return min(step.clearance for step in steps), min(step.wall_clearance for step in steps)


def trial_of(scene: Scene, **changes: Any) -> UncertainTrial:
    usual: dict[str, Any] = {
        "policy": Ramming(),
        "v_max": 0.5,
        "actual": Uncertainty(),
        "errors": Adversary(),
        "num_steps": 8,
    }
    return UncertainTrial(scene, **(usual | changes))


@settings(max_examples=60)
@given(
    scene=worlds(),
    bounds=uncertainties(),
    errors=st.sampled_from((Adversary(), Adversary((0.0,)), Adversary(SIDES[2:]), AtRandom())),
    policy=st.sampled_from((Ramming(), UniformRandom())),
    omega_max=st.sampled_from((0.0, 0.0, 0.5, 1.5)),
    seed=st.integers(0, 9999),
)
def test_nobody_touches_anybody_as_long_as_errors_are_within_their_bounds(
    scene: Scene,
    bounds: Uncertainty,
    errors: Errors,
    policy: Policy,
    omega_max: float,
    seed: int,
) -> None:
    assume(is_apart(scene))
    rate = omega_max + 2.0 * bounds.actuation_error / (DT + bounds.lateness)
    turned = bounds.heading_error + rate * bounds.stale_time(DT) if omega_max else 0.0
    assume(turned + math.asin(min(1.0, 1.05 * bounds.actuation_error)) < math.pi / 2)
    kinematics = DifferentialDrive(0.5, omega_max, DT, 0.01) if omega_max else Holonomic(0.5)
    safety = SafetyFilter([PriorityORCA(2.0), Separation(DT, uncertainty=bounds)], kinematics)
    trial = trial_of(
        scene, actual=bounds, errors=errors, policy=policy, omega_max=omega_max, seed=seed
    )
    assert min(least(safety, trial)) >= -CONTACT_TOLERANCE


def duel(gap: float = 0.3) -> Scene:
    return Scene.from_world([[0.0, 0.0], [1.0 + gap, 0.0]], np.zeros((2, 2)), 0.5)


def exact() -> SafetyFilter:
    return SafetyFilter([Separation(DT)], Holonomic(0.5))


@pytest.mark.parametrize("gap", [0.05, 0.3])
def test_without_errors_it_is_the_closed_loop_that_everyone_knows(gap: float) -> None:
    clearance, _ = least(exact(), trial_of(duel(gap)))
    assert 0.0 < clearance < 1e-3


def test_an_error_of_positions_alone_makes_the_exact_filter_collide() -> None:
    trial = trial_of(duel(), actual=Uncertainty(position_error=0.02), errors=Adversary((0.0,)))
    clearance, _ = least(exact(), trial)
    # Each takes the gap to be 4 cm wider than it is.
    assert clearance == pytest.approx(-0.04, abs=2e-3)


def test_the_margin_for_positions_is_not_slack() -> None:
    bounds = Uncertainty(position_error=0.02)
    trial = trial_of(duel(), actual=bounds, errors=Adversary((0.0,)), num_steps=20)
    safety = SafetyFilter([Separation(DT, uncertainty=bounds)], Holonomic(0.5))
    clearance, _ = least(safety, trial)
    assert 0.0 <= clearance < 1e-4


class BothFurtherUp:
    """Two robots that each take the other to be further up, and themselves further down, by all of the bound."""

    def __init__(self) -> None:
        # Each decision asks for the errors of a position and a velocity, robot by robot, and of what executes.
        ups = (-1.0, 0.0, 1.0, 0.0, 0.0), (1.0, 0.0, -1.0, 0.0, 0.0)
        self.ups = itertools.cycle(itertools.chain(*ups))

    def part(self, rng: np.random.Generator) -> float:  # noqa: ARG002
        return 1.0

    def age(self, rng: np.random.Generator) -> float:  # noqa: ARG002
        return 1.0

    def offset(self, away: FloatArray, rng: np.random.Generator) -> FloatArray:  # noqa: ARG002
        return np.array([0.0, next(self.ups)])


def test_a_row_along_the_estimated_direction_alone_would_not_do() -> None:
    # Aside of where the other seems to be the way is free, and leads to where it is.
    bounds = Uncertainty(position_error=0.05)
    scene = Scene.from_world([[0.0, 0.0], [0.31, 0.0]], np.zeros((2, 2)), 0.1)

    def slide(separation: Separation) -> float:
        trial = trial_of(
            scene,
            policy=GoalSeeking(((50.0, -50.0), (-50.0, -50.0)), DT),
            actual=bounds,
            errors=BothFurtherUp(),
            num_steps=40,
        )
        return least(SafetyFilter([separation], Holonomic(0.5)), trial)[0]

    assert slide(Separation(DT, uncertainty=bounds)) >= 0.0
    assert slide(Separation(DT, safety_margin=1e-6 + 2 * 0.05)) < 0.0


def test_robots_that_creep_while_told_to_stand_have_only_time() -> None:
    # Why standing still is assumed to be exact: 1 mm/s each, and a gap of 2 cm is gone after ten seconds.
    scene, creep = duel(0.02), 1e-3
    assert least(exact(), trial_of(scene, policy=GoalSeeking(((0, 0), (1.02, 0)), DT)))[0] > 0.0199
    assert 0.02 / (2 * creep) == pytest.approx(10.0)


@pytest.mark.parametrize("seed", range(5))
def test_commands_begin_in_order_and_positions_are_continuous(seed: int) -> None:
    late = Uncertainty(actuation_delay=0.5, clock_jitter=0.1)
    trial = trial_of(duel(5.0), policy=UniformRandom(), actual=late, errors=AtRandom(), seed=seed)
    places = [trial.scene.position, *(step.position for step in roll_out_uncertain(exact(), trial))]
    steps = np.linalg.norm(np.diff(np.array(places), axis=0), axis=2)
    assert steps.max() <= 0.5 * DT * (1.0 + 1e-5)
    assert steps.max() > 0.0


def test_the_same_seed_is_the_same_trial() -> None:
    bounds = Uncertainty(position_error=0.02, actuation_error=0.1, clock_jitter=0.05)
    trial = trial_of(duel(), actual=bounds, errors=AtRandom(), seed=3)
    first, second = (
        [step.position.tolist() for step in roll_out_uncertain(exact(), trial)] for _ in range(2)
    )
    assert first == second


@example(side=0.0)
@given(side=st.floats(-math.pi, math.pi))
def test_the_adversary_is_on_the_bound(side: float) -> None:
    rng = np.random.default_rng(0)
    away = np.array([0.6, 0.8])
    off = Adversary((side,)).offset(away, rng)
    assert np.hypot(*off) == pytest.approx(1.0)
    assert off @ away == pytest.approx(math.cos(side))
    assert {Adversary().part(rng) for _ in range(50)} == {0.0, 1.0}

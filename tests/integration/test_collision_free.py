"""The promise that everything stands on: filtered robots never collide, whatever drives them and whoever solves.

The judge is `safefilter.closest_approach`, which shares no formula with the filter. The counts that these tests
assert are printed by ``python -m safefilter.testing.stress``; millions of them are driven by the slice of the stress
campaign, `tests/assurance/stress/test_campaign.py`.
"""

from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.constraints.priority_orca import VOpt
from safefilter.testing.campaign import Setting, drive
from safefilter.testing.invariants import assert_collision_free
from safefilter.testing.rollout import Trial
from safefilter.testing.strategies import crowded, head_on, rollouts, touching

OTHER_BACKENDS = [name for name in sf.available_backends() if name != "planar"]
V_OPTS: tuple[VOpt, ...] = ("current", "shared", "own")


def filter_of(trial: Trial, v_opt: VOpt = "current", backend: str = "planar") -> sf.SafetyFilter:
    constraints: list[sf.Constraint] = [
        sf.PriorityORCA(2.0, v_opt),
        sf.Separation(trial.dt, passive_speed=trial.passive_speed),
    ]
    return sf.SafetyFilter(constraints, sf.Holonomic(trial.v_max), backend=backend)


@given(rollouts(), st.sampled_from(V_OPTS))
def test_robots_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@given(rollouts(touching()), st.sampled_from(V_OPTS))
def test_robots_that_start_in_contact_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@given(rollouts(crowded()), st.sampled_from(V_OPTS))
def test_crowded_robots_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@given(rollouts(head_on(), dt=0.05), st.sampled_from(V_OPTS))
def test_robots_face_to_face_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@given(rollouts(crowded()))
def test_separation_alone_is_enough(trial: Trial) -> None:
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    assert_collision_free(sf.SafetyFilter([separation], sf.Holonomic(trial.v_max)), trial)


@given(rollouts(crowded()), st.sampled_from(["clarabel", "qpsolvers:daqp", "osqp"]))
def test_robots_never_collide_with_a_solver_of_someone_else(trial: Trial, backend: str) -> None:
    assert_collision_free(filter_of(trial, backend=backend), trial)


@pytest.mark.stress
@pytest.mark.parametrize("backend", OTHER_BACKENDS)
def test_ten_thousand_robot_steps_without_a_collision(backend: str) -> None:
    tally = drive(partial(Setting.safety_filter, backend=backend), 10_000, seed=1)
    assert tally.robot_steps >= 10_000
    assert tally.collisions == 0
    assert tally.uncertified == 0
    assert min(tally.cases) >= 500


@pytest.mark.stress
def test_the_same_runs_collide_without_the_filter_and_with_orca_alone() -> None:
    filtered = drive(Setting.safety_filter, 100_000, seed=0)
    orca_alone = drive(partial(Setting.safety_filter, has_separation=False), 100_000, seed=0)
    unfiltered = drive(lambda _: None, 100_000, seed=0)
    assert filtered.collisions == 0
    assert orca_alone.collisions >= 1000
    assert unfiltered.collisions > orca_alone.collisions

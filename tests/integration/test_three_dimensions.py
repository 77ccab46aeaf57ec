"""The promise that everything stands on, in space: filtered robots never collide, whatever drives them.

The judge is `safefilter.closest_approach`, which shares no formula with the filter.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.constraints.priority_orca import VOpt
from safefilter.testing.invariants import Collision, assert_collision_free
from safefilter.testing.policies import GoalSeeking, Mixed, NotFinite, Ramming, UniformRandom
from safefilter.testing.rollout import Trial
from safefilter.testing.space_strategies import (
    crowded_in_space,
    scenes_in_space,
    touching_in_space,
)
from safefilter.testing.strategies import rollouts

V_OPTS: tuple[VOpt, ...] = ("current", "shared", "own")


def filter_of(trial: Trial, v_opt: VOpt = "current", backend: str = "planar") -> sf.SafetyFilter:
    constraints: list[sf.Constraint] = [
        sf.PriorityORCA(2.0, v_opt),
        sf.Separation(trial.dt, passive_speed=trial.passive_speed),
    ]
    kinematics = sf.Holonomic(trial.v_max, dimension=3)
    return sf.SafetyFilter(constraints, kinematics, backend=backend)


@given(rollouts(scenes_in_space()), st.sampled_from(V_OPTS))
def test_robots_in_space_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@settings(max_examples=40)
@given(rollouts(touching_in_space()), st.sampled_from(V_OPTS))
def test_robots_in_space_that_start_in_contact_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@settings(max_examples=40)
@given(rollouts(crowded_in_space()), st.sampled_from(V_OPTS))
def test_crowded_robots_in_space_never_collide(trial: Trial, v_opt: VOpt) -> None:
    assert_collision_free(filter_of(trial, v_opt), trial)


@settings(max_examples=40)
@given(rollouts(crowded_in_space()))
def test_separation_alone_is_enough_in_space(trial: Trial) -> None:
    separation = sf.Separation(trial.dt, passive_speed=trial.passive_speed)
    kinematics = sf.Holonomic(trial.v_max, dimension=3)
    assert_collision_free(sf.SafetyFilter([separation], kinematics), trial)


@settings(max_examples=10)
@given(rollouts(crowded_in_space()))
def test_robots_in_space_never_collide_with_a_solver_of_someone_else(trial: Trial) -> None:
    assert_collision_free(filter_of(trial, backend="clarabel"), trial)


def cloud(seed: int, num_robots: int) -> sf.Scene:
    """A cube full of robots, each with some room around it."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.cbrt(num_robots)))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3), axis=-1).reshape(-1, 3)[:num_robots]
    return sf.Scene.from_world(
        0.5 * grid + rng.uniform(-0.08, 0.08, grid.shape),
        np.zeros((num_robots, 3)),
        rng.uniform(0.05, 0.15, num_robots),
        priority=10.0 ** rng.uniform(-2.0, 2.0, num_robots),
        cooperative=(np.arange(num_robots) == 0) | (rng.uniform(size=num_robots) > 0.1),
        reach=3.0,
    )


def trial_in_cloud(seed: int, num_robots: int = 64, num_steps: int = 30) -> Trial:
    scene = cloud(seed, num_robots)
    policy = Mixed((GoalSeeking.across(scene, 0.2), NotFinite(Ramming()), UniformRandom()))
    v_max = np.random.default_rng(seed).uniform(0.5, 1.5, num_robots)
    return Trial(scene, policy, v_max, num_steps=num_steps, seed=seed, is_single=seed % 2 == 0)


@pytest.mark.parametrize("seed", range(3))
def test_a_cloud_of_robots_with_all_three_cases_never_collides(seed: int) -> None:
    trial = trial_in_cloud(seed)
    tally = assert_collision_free(filter_of(trial), trial)
    assert min(tally.cases) > 0


def test_the_same_cloud_collides_with_orca_alone() -> None:
    trial = trial_in_cloud(0)
    orca = sf.SafetyFilter([sf.PriorityORCA(2.0)], sf.Holonomic(trial.v_max, dimension=3))
    with pytest.raises(Collision):
        assert_collision_free(orca, trial)

"""Strategies draw what their names say, and reach what they are for."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import find, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.closest_approach import closest_approach, pairs_within
from safefilter.testing.rollout import Trial
from safefilter.testing.strategies import (
    GAPS,
    MAX_ROBOTS,
    MAX_SPEED,
    actions,
    crowded,
    degenerate,
    head_on,
    priorities,
    radii,
    rollouts,
    scenes,
    speeds,
    symmetric,
    touching,
    velocities,
)


def gaps(scene: sf.Scene) -> FloatArray:
    still = np.zeros_like(scene.position)
    return closest_approach(scene.position, still, scene.radius, pairs_within(scene.world)).start


@given(st.one_of(scenes(), crowded(), touching(), head_on(), symmetric()))
def test_nobody_overlaps_at_the_start(scene: sf.Scene) -> None:
    assert gaps(scene).min() >= -1e-11


@given(scenes())
def test_scenes_have_a_few_robots_and_the_first_cooperates(scene: sf.Scene) -> None:
    assert 2 <= scene.num_robots <= MAX_ROBOTS
    assert scene.cooperative[0]
    assert scene.wanted is not None
    assert np.hypot(*scene.velocity.T).max() <= MAX_SPEED + 1e-12


@given(touching())
def test_touching_robots_each_touch_another(scene: sf.Scene) -> None:
    pairs, gap = pairs_within(scene.world), np.abs(gaps(scene))
    touches = gap <= 1e-11
    touched = np.concatenate([pairs.first[touches], pairs.second[touches]])
    assert set(touched.tolist()) == set(range(scene.num_robots))


@given(crowded())
def test_crowds_are_of_four_to_eight_each_near_another(scene: sf.Scene) -> None:
    assert 4 <= scene.num_robots <= 8
    assert gaps(scene).min() <= 0.05 + 1e-9


@given(head_on())
def test_robots_head_on_come_straight_at_each_other(scene: sf.Scene) -> None:
    assert scene.velocity[0].tolist() == (-scene.velocity[1]).tolist()
    assert scene.velocity[0, 0] > 0.0
    assert scene.position[0].tolist() == (-scene.position[1]).tolist()
    assert scene.radius[0] == scene.radius[1]


@given(symmetric())
def test_symmetric_robots_are_each_other_turned_round(scene: sf.Scene) -> None:
    assert np.array_equal(scene.position[0], -scene.position[1])
    assert np.array_equal(scene.velocity[0], -scene.velocity[1])
    assert scene.wanted is not None
    assert np.array_equal(scene.wanted, scene.velocity)


@given(radii(), speeds(), priorities(), velocities(0.5))
def test_numbers_are_within_their_limits(
    radius: float, speed: float, priority: float, velocity: tuple[float, float]
) -> None:
    assert 0.05 <= radius <= 0.5
    assert 0.1 <= speed <= 2.0
    assert 1e-3 <= priority <= 1e3
    assert np.hypot(*velocity) <= 0.5 + 1e-12


@given(st.data(), scenes())
def test_actions_are_one_velocity_a_robot(data: st.DataObject, scene: sf.Scene) -> None:
    wanted = data.draw(actions(scene))
    assert wanted.shape == (scene.num_robots, 2)
    assert np.hypot(*wanted.T).max() <= 1.25 * MAX_SPEED + 1e-12


@given(rollouts(dt=0.1))
def test_trials_are_of_the_step_asked_for(trial: Trial) -> None:
    assert trial.dt == 0.1
    assert trial.v_max.shape == (trial.scene.num_robots,)


def test_scenes_shrink_to_two_robots_of_round_numbers() -> None:
    scene = find(scenes(), lambda _: True)
    assert scene.num_robots == 2
    assert scene.radius.tolist() == [0.05, 0.05]
    assert scene.position.tolist() == [[0.0, 0.0], [pytest.approx(1.1), 0.0]]
    assert scene.velocity.tolist() == [[0.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize("gap", GAPS)
def test_every_gap_is_drawn(gap: float) -> None:
    found = find(scenes(st.just(2)), lambda scene: abs(float(gaps(scene)[0]) - gap) < 1e-9)
    assert found.num_robots == 2


def test_a_ratio_of_a_million_is_drawn() -> None:
    pairs = scenes(st.just(2))
    found = find(pairs, lambda scene: scene.priority.max() >= 1e6 * scene.priority.min())
    assert sorted(found.priority.tolist())[0] == 1e-3


def test_robots_that_do_not_cooperate_are_drawn() -> None:
    found = find(scenes(st.just(2)), lambda scene: not scene.cooperative.all())
    assert found.cooperative.tolist() == [True, False]


def test_robots_may_be_asked_to_ram() -> None:
    scene = find(head_on(), lambda _: True)
    wanted = find(actions(scene), lambda drawn: bool(drawn[0, 0] > 0.0 and drawn[0, 1] == 0.0))
    assert wanted[0, 0] > 0.0


@given(degenerate())
def test_degenerate_scenes_are_of_two_to_four_in_line(scene: sf.Scene) -> None:
    assert 2 <= scene.num_robots <= 4
    assert not scene.position[:, 1].any()
    assert scene.cooperative[0]


def at_cutoff_centre(scene: sf.Scene) -> bool:
    relative = scene.velocity[0] - scene.velocity[1]
    offset = scene.position[1] - scene.position[0]
    return bool(offset.any() and np.allclose(relative, offset / 2.0, rtol=1e-12, atol=0.0))


@pytest.mark.parametrize(
    "is_hard",
    [
        lambda scene: (scene.position[0] == scene.position[1]).all(),
        lambda scene: gaps(scene).min() < -0.01,
        lambda scene: (gaps(scene) == 0.0).any(),
        lambda scene: (scene.velocity[0] == scene.velocity[1]).all(),
        at_cutoff_centre,
        lambda scene: scene.priority.max() == 1e6 * scene.priority.min(),
    ],
    ids=["coincide", "overlap", "touch", "equal velocities", "centre of the cut-off", "priorities"],
)
def test_what_is_hard_about_them_is_drawn(is_hard: Callable[[sf.Scene], bool]) -> None:
    assert is_hard(find(degenerate(), is_hard))

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.closest_approach import closest_approach, pairs_within
from safefilter.testing.crowds import (
    MAX_ROBOTS,
    MIN_ROBOTS,
    RADII,
    SPEEDS,
    put_down,
    random_crowd,
)


@given(st.integers(0, 10_000))
def test_nobody_overlaps_and_everyone_is_within_the_limits(seed: int) -> None:
    scene, v_max = random_crowd(np.random.default_rng(seed), 60)
    still = np.zeros_like(scene.position)
    gaps = closest_approach(scene.position, still, scene.radius, pairs_within(scene.world)).start
    assert gaps.min() >= -1e-13
    sizes = np.bincount(scene.world)
    assert sizes.min() >= MIN_ROBOTS
    assert sizes.max() <= MAX_ROBOTS
    assert sizes.sum() >= 60
    assert RADII[0] <= scene.radius.min() <= scene.radius.max() <= RADII[1]
    assert SPEEDS[0] / 2 <= v_max.min() <= v_max.max() <= SPEEDS[1]
    assert 1e-3 <= scene.priority.min() <= scene.priority.max() <= 1e3


def test_crowds_hold_everything_that_is_to_be_shown() -> None:
    scene, _ = random_crowd(np.random.default_rng(0), 3000)
    still = np.zeros_like(scene.position)
    gaps = closest_approach(scene.position, still, scene.radius, pairs_within(scene.world)).start
    assert (np.abs(gaps) < 1e-12).sum() > 100
    assert (np.abs(gaps - 1e-6) < 1e-12).sum() > 100
    assert (gaps > 1.0).sum() > 100
    sizes = np.bincount(scene.world)
    assert (sizes == 2).any()
    assert (sizes > 40).any()
    assert 0.05 < 1.0 - scene.cooperative.mean() < 0.2
    assert scene.priority.max() / scene.priority.min() > 1e5
    # Someone to decide for in every world.
    assert set(scene.world[scene.cooperative].tolist()) == set(range(len(sizes)))


def test_a_robot_without_a_free_place_beside_others_is_put_far_away() -> None:
    # A small disc with fifty large ones around it has no room left.
    radius = np.concatenate([[0.05], np.full(49, 0.5)])
    place = put_down(np.random.default_rng(0), np.array([50]), radius)
    still = np.zeros_like(place)
    pairs = pairs_within(np.zeros(50, dtype=np.int64))
    assert closest_approach(place, still, radius, pairs).start.min() >= -1e-13


def test_the_same_seed_gives_the_same_crowd() -> None:
    first, second = (random_crowd(np.random.default_rng(7), 50) for _ in range(2))
    assert np.array_equal(first.scene.state, second.scene.state)
    assert first.v_max == pytest.approx(second.v_max, abs=0.0)


@given(st.integers(0, 10_000), st.sampled_from([2, 20, 200]))
def test_in_space_nobody_overlaps_either(seed: int, most_robots: int) -> None:
    rng = np.random.default_rng(seed)
    scene, _ = random_crowd(rng, 30, most_robots=most_robots, dimension=3)
    assert scene.dimension == 3
    still = np.zeros_like(scene.position)
    gaps = closest_approach(scene.position, still, scene.radius, pairs_within(scene.world)).start
    assert gaps.min() >= -1e-13
    assert MIN_ROBOTS <= np.bincount(scene.world).max() <= most_robots


def test_in_space_robots_go_and_stand_in_every_direction() -> None:
    scene, _ = random_crowd(np.random.default_rng(0), 2000, dimension=3)
    for part in (scene.velocity, scene.position):
        spread = part.std(axis=0)
        assert spread.min() > 0.8 * spread.max()
    # Robots were put down in contact, above and below others too.
    first, second = pairs_within(scene.world)
    offset = scene.position[second] - scene.position[first]
    gap = np.linalg.norm(offset, axis=1) - scene.radius[first] - scene.radius[second]
    rise = np.abs(offset[np.abs(gap) < 1e-12, 2])
    assert len(rise) > 50
    assert rise.max() > 0.5

from typing import Any

import numpy as np
import pytest

from envs import Circle, Navigation
from envs.sensing import Sensing
from safefilter.errors import OutOfRange


def walked(sensing: Sensing, num_steps: int = 8, num_worlds: int = 3) -> Navigation:
    navigation = Navigation(Circle(6), num_worlds=num_worlds, sensing=sensing)
    navigation.reset(1)
    for _ in range(num_steps):
        navigation.step(navigation.world.preferred_velocity())
    return navigation


def test_perfect_sensing_is_the_state_itself() -> None:
    navigation = walked(Sensing())
    assert navigation.observer.sensed.arrays.position is navigation.world.position


def test_a_delay_shows_an_earlier_moment() -> None:
    late, early = walked(Sensing(delay=3), 8), walked(Sensing(), 5)
    sensed = late.observer.sensed.arrays
    np.testing.assert_array_equal(sensed.position, early.world.position)
    np.testing.assert_array_equal(sensed.velocity, early.world.velocity)
    np.testing.assert_array_equal(late.scenes().position, early.scenes().position)


def test_before_the_delay_is_over_everyone_is_known_to_be_at_the_start() -> None:
    late, start = walked(Sensing(delay=5), 4), walked(Sensing(), 0)
    np.testing.assert_array_equal(late.observer.sensed.arrays.position, start.world.position)


def test_noise_has_the_size_asked_for() -> None:
    navigation = walked(Sensing(position_noise=0.02, velocity_noise=0.05), 2, num_worlds=2000)
    sensed, world = navigation.observer.sensed.arrays, navigation.world
    assert (sensed.position - world.position).std() == pytest.approx(0.02, rel=0.02)
    assert (sensed.velocity - world.velocity).std() == pytest.approx(0.05, rel=0.02)
    np.testing.assert_array_equal(sensed.heading, world.heading)


def test_what_does_not_arrive_leaves_the_last_that_did() -> None:
    nothing, start = walked(Sensing(dropout=1.0)), walked(Sensing(), 0)
    np.testing.assert_array_equal(nothing.observer.sensed.arrays.position, start.world.position)
    half = walked(Sensing(dropout=0.5), 1, num_worlds=2000)
    is_old = (half.observer.sensed.arrays.position != half.world.position).all(axis=-1)
    assert is_old.mean() == pytest.approx(0.5, abs=0.03)


def test_noise_neither_depends_on_threads_nor_on_other_worlds() -> None:
    sensing = Sensing(position_noise=0.02, delay=1, dropout=0.2)
    few, many = walked(sensing, num_worlds=2), walked(sensing, num_worlds=300)
    np.testing.assert_array_equal(
        few.observer.sensed.arrays.position, many.observer.sensed.arrays.position[:2]
    )


def test_the_true_world_does_not_depend_on_how_well_it_is_known() -> None:
    noisy, exact = walked(Sensing(position_noise=0.1, delay=2)), walked(Sensing())
    np.testing.assert_array_equal(noisy.world.position, exact.world.position)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("position_noise", -0.1, "position_noise: expected 0 or more"),
        ("dropout", 1.5, "dropout: expected a probability"),
        ("delay", -1, "delay: expected 0 steps or more"),
    ],
)
def test_impossible_sensing_is_refused(field: str, value: Any, message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        Sensing(**{field: value})

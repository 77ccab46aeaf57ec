from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from safefilter.arrays import FloatArray
from safefilter.kinematics.tracking import command_towards, largest_tracked_speed, tracked_part

NUM_RANDOM = 100_000


def tracking_error(
    angle: FloatArray, speed: FloatArray, v: FloatArray, w: FloatArray, end: FloatArray
) -> FloatArray:
    """Largest distance between unicycle and holonomic course at 201 instants until the turn is over."""
    worst = np.zeros(len(angle))
    for part in np.linspace(0.0, 1.0, 201):
        time = part * end
        half = 0.5 * w * time
        length = v * time * np.sinc(half / np.pi)
        x = length * np.cos(half) - speed * time * np.cos(angle)
        y = length * np.sin(half) - speed * time * np.sin(angle)
        worst = np.maximum(worst, np.hypot(x, y))
    return worst


def published_speed(angle: float, turn_time: float, error: float) -> float:
    """The bound as printed in NH-ORCA, before half-angle simplification."""
    c = 2.0 * (1.0 - math.cos(angle))
    return error / turn_time * math.sqrt(c / (c - math.sin(angle) ** 2))


@pytest.mark.parametrize("angle", [0.05, 0.3, 1.0, 2.0, 3.0])
def test_the_half_angle_form_is_the_published_one(angle: float) -> None:
    speed = largest_tracked_speed(angle, 100.0, 100.0, 0.3, 0.05)
    assert speed == pytest.approx(published_speed(angle, 0.3, 0.05), rel=1e-9)
    c = 2.0 * (1.0 - math.cos(angle))
    assert tracked_part(angle) == pytest.approx(angle * math.sin(angle) / c, rel=1e-9)


def simulated_error(
    angle: FloatArray, speed: FloatArray, omega_max: FloatArray, turn_time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(worst tracking error, speed of the command) of drives told to follow velocities; see `tracking_error`."""
    commands = np.array([
        command_towards(*row) for row in zip(angle, speed, omega_max, turn_time, strict=True)
    ])
    in_place = np.abs(angle) > omega_max * turn_time
    end = np.where(in_place, np.abs(angle) / omega_max, turn_time)
    assert (np.abs(commands[:, 1]) <= omega_max).all()
    return tracking_error(angle, speed, commands[:, 0], commands[:, 1], end), commands[:, 0]


@pytest.mark.stress
def test_the_error_stays_within_eps_for_a_hundred_thousand_random_drives() -> None:
    rng = np.random.default_rng(5)
    angle = rng.uniform(-math.pi, math.pi, NUM_RANDOM)
    v_max, omega_max = rng.uniform(0.05, 2.0, NUM_RANDOM), rng.uniform(0.5, 5.0, NUM_RANDOM)
    turn_time, error = rng.uniform(0.05, 1.0, NUM_RANDOM), 10.0 ** rng.uniform(-3, 0, NUM_RANDOM)
    rim = np.array([
        largest_tracked_speed(*row)
        for row in zip(angle, v_max, omega_max, turn_time, error, strict=True)
    ])
    # Half of them on the rim, half anywhere inside.
    speed = rim * np.where(rng.integers(2, size=NUM_RANDOM) == 1, 1.0, rng.uniform(size=NUM_RANDOM))
    worst, command_speed = simulated_error(angle, speed, omega_max, turn_time)
    assert (worst <= error * (1.0 + 1e-9)).all()
    assert (command_speed <= v_max * (1.0 + 1e-12)).all()
    # The bound is not slack for its own sake: many drives use all of it.
    assert (worst >= 0.999 * error).mean() > 0.1


def speed_in_hull(hull: ConvexHull, angle: FloatArray) -> FloatArray:
    """Distance from the origin to the boundary of a hull along angles."""
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    along = direction @ hull.equations[:, :2].T
    with np.errstate(divide="ignore"):
        reach = np.where(along > 1e-12, -hull.equations[:, 2] / along, np.inf)
    return np.asarray(reach.min(axis=1))


def test_the_hull_of_the_set_fails_the_same_test() -> None:
    rng = np.random.default_rng(6)
    broken, largest = 0, 0.0
    for _ in range(50):
        v_max, omega_max = rng.uniform(0.05, 2.0), rng.uniform(0.5, 5.0)
        turn_time, error = rng.uniform(0.05, 1.0), 10.0 ** rng.uniform(-3, 0)
        rim_angle = np.linspace(-math.pi, math.pi, 721)
        rim = np.array([
            largest_tracked_speed(a, v_max, omega_max, turn_time, error) for a in rim_angle
        ])
        hull = ConvexHull(np.stack([rim * np.cos(rim_angle), rim * np.sin(rim_angle)], axis=1))
        angle = rng.uniform(-math.pi, math.pi, 200)
        same = np.ones(200)
        worst, _ = simulated_error(
            angle, speed_in_hull(hull, angle), omega_max * same, turn_time * same
        )
        broken += int((worst > 1.001 * error).sum())
        largest = max(largest, float((worst / error).max()))
    assert broken > 1000  # of 10 000
    assert largest > 2.0


def test_straight_ahead_is_tracked_at_full_speed() -> None:
    assert largest_tracked_speed(0.0, 0.2, 2.5, 0.3, 0.02) == 0.2
    assert command_towards(0.0, 0.2, 2.5, 0.3) == (0.2, 0.0)


def test_a_turn_too_wide_for_the_turn_time_is_made_on_the_spot() -> None:
    assert command_towards(-2.0, 0.1, 2.5, 0.3) == (0.0, -2.5)
    assert largest_tracked_speed(-2.0, 0.2, 2.5, 0.3, 0.02) == pytest.approx(0.025)

"""Rows of separation one by one, as kernels write them: which there are, and what errors take from their budgets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from safefilter import Uncertainty
from safefilter.arrays import FloatArray
from safefilter.constraints.separation import Separation, _separation_rows
from safefilter.errors import InvalidInput
from safefilter.scene import Scene

DT = 0.25


def pair(distance: float, velocity: tuple[float, float] | None = None, **known: Any) -> Scene:
    """Robots of radius 0.5 m in the direction (0.6, 0.8) of each other; the other cooperates if it has no velocity."""
    return Scene.from_world(
        [[1.0, 2.0], [1.0 + 0.6 * distance, 2.0 + 0.8 * distance]],
        [[0.0, 0.0], velocity or (0.0, 0.0)],
        0.5,
        cooperative=[True, velocity is None],
        **known,
    )


def rows_of(
    scene: Scene, limits: tuple[float, float], margin: float = 0.0, **errors: Any
) -> FloatArray:
    """Rows of robot 0 against robot 1, shape (3, M).

    Args:
        scene: Two robots.
        limits: Their largest speeds, in m/s.
        margin: Safety margin, in m.
        errors: Fields of `SeparationSettings`.
    """
    settings = Separation(DT, margin).settings(5, 6)._replace(**errors)
    array, label, count = _separation_rows(
        scene.arrays, settings, np.array(limits), np.array([0]), 32
    )
    assert label[0, :, : count[0]].T.tolist() == [[5, 1]] * int(count[0])
    return array[0, :, : count[0]]


@pytest.mark.parametrize("limits", [(2.0, 2.0), (6.0, 2.0)])
@pytest.mark.parametrize("error", [0.0, 0.0625])
@pytest.mark.parametrize("margin", [0.0, 0.125])
@pytest.mark.parametrize("gain", [1.0, 1.5])
def test_a_neighbour_gets_a_row_as_far_as_both_get(
    limits: tuple[float, float], error: float, margin: float, gain: float
) -> None:
    reach = (limits[0] + limits[1]) * gain * DT
    end = 1.0 + margin + reach + 2.0 * error
    # Nothing is dropped a hair too early, and nothing far away costs anything.
    near, far = pair(end * (1.0 - 3e-13)), pair(end * 1.01)
    found = rows_of(near, limits, margin, position_error=error, gain=gain)
    cosine = math.sqrt(1.0 - (2.0 * error / end) ** 2)
    np.testing.assert_allclose(-found[2], [limits[0] * cosine] * (2 if error else 1))
    assert rows_of(far, limits, margin, position_error=error, gain=gain).shape == (3, 0)


def test_a_budget_counts_what_executes_not_what_is_commanded() -> None:
    # Half of the gap each, as the other gets far; what executes is longer than the command by a quarter.
    limits = (4.0, 100.0)
    (offset,) = rows_of(pair(1.0 + 2.4), limits, gain=1.25)[2]
    assert -offset == pytest.approx(1.2 / (1.25 * DT))
    assert rows_of(pair(1.0 + 2.6), limits, gain=1.25).size == 0


@pytest.mark.parametrize(
    ("velocity", "errors", "budget"),
    [
        # 5 m apart, 3 m of them uncertain: e may be off by asin(0.6), and 0.6 of any speed may be an approach.
        ((-0.8, 0.6), {"position_error": 1.5}, 1.0 - 0.6 * DT),
        ((0.6, 0.8), {"position_error": 1.5}, 1.0 - 0.6 * DT),
        ((-0.6, -0.8), {"position_error": 1.5}, 1.0 - 1.6 * DT),
        ((-0.8, 0.6), {"velocity_error": 0.5}, 4.0 - 0.5 * DT),
        ((-0.6, -0.8), {"velocity_error": 0.5}, 4.0 - 1.5 * DT),
        ((-0.6, -0.8), {"position_error": 1.5, "velocity_error": 0.5}, 1.0 - 2.1 * DT),
        ((-0.6, -0.8), {"velocity_error": 0.5, "passive_speed": 2.0}, 4.0 - 2.0 * DT),
    ],
)
def test_a_passive_robot_is_credited_with_all_that_its_velocity_may_be(
    velocity: tuple[float, float], errors: dict[str, float], budget: float
) -> None:
    cosine = 0.8 if "position_error" in errors else 1.0
    found = rows_of(pair(5.0, velocity), (99.0, 0.0), **errors)
    np.testing.assert_allclose(-found[2] * DT, budget * cosine)


def test_a_passive_robot_moves_on_as_fast_as_it_may_be() -> None:
    # For half a second: this one by 0.5 m, the other by (1 + 0.5) / 2 m, not by what its kinematics would allow.
    errors = {"stale_time": 0.5, "velocity_error": 0.5}
    found = rows_of(pair(5.0, (0.6, 0.8)), (1.0, 0.0), passive_speed=18.0, **errors)
    # With passive_speed the other may move by 9 m: nothing is certain, and three rows leave nothing but standing still.
    assert found[2].tolist() == [0.0, 0.0, 0.0]
    found = rows_of(pair(2.5, (0.6, 0.8)), (1.0, 0.0), **errors)
    sine = 1.25 / 2.5
    credited = (1.0 * sine + 0.5) * DT
    np.testing.assert_allclose(
        -found[2] * DT, (2.5 - 1.0 - 1.25 - credited) * math.sqrt(1.0 - sine**2)
    )


def test_steps_that_end_late_are_longer() -> None:
    late = Uncertainty(actuation_delay=0.25, clock_jitter=0.125)
    settings = Separation(DT, uncertainty=late).settings(0, 1)
    assert settings.dt == DT + 0.375
    assert settings.stale_time == 0.375


def test_robots_that_do_not_turn_have_no_heading_to_be_wrong() -> None:
    settings = Separation(DT, uncertainty=Uncertainty(heading_error=0.1)).settings(0, 1)
    assert (settings.turn_cosine, settings.turn_sine) == (1.0, 0.0)


def test_bounds_on_errors_are_for_robots_in_the_plane() -> None:
    exact, uncertain = Separation(DT), Separation(DT, uncertainty=Uncertainty(position_error=0.1))
    exact.require_dimension(2)
    exact.require_dimension(3)
    uncertain.require_dimension(2)
    with pytest.raises(InvalidInput, match="robots in the plane only"):
        uncertain.require_dimension(3)


def test_alone_it_makes_rows_against_robots_and_walls_and_names_them() -> None:
    walls = [[[3.0, -1.0], [3.0, 1.0]], [[-3.0, -1.0], [-3.0, 1.0]]]
    scene = Scene.from_world([[0.0, 0.0], [0.0, 4.0]], np.zeros((2, 2)), 0.5, walls=walls)
    rows = Separation(DT, 0.0).half_spaces(scene, np.zeros((1, 2)), np.array([0]))
    assert [rows.describe(0, int(m)) for m in np.flatnonzero(rows.present[0])] == [
        "separation 1",
        "wall_separation 0",
        "wall_separation 1",
    ]
    assert (-rows.offsets[0] * DT).tolist() == [1.5, 2.5, 2.5]


def test_robots_in_space_measure_along_the_line_of_centres() -> None:
    scene = Scene.from_world([[0.0, 0.0, 0.0], [2.0, 3.0, 6.0]], np.zeros((2, 3)), 0.5)
    rows = Separation(DT, 0.0).half_spaces(scene, np.zeros((2, 3)), np.arange(2))
    np.testing.assert_allclose(rows.normals[:, 0] * 7.0, [[-2.0, -3.0, -6.0], [2.0, 3.0, 6.0]])
    assert (-rows.offsets[:, 0] * DT).tolist() == [3.0, 3.0]

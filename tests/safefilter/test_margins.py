"""Formulas and rows of margins; that robots stay apart in a closed loop is in `test_uncertain_loop`."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter import DifferentialDrive, Holonomic, SafetyFilter, Scene, Separation, Uncertainty
from safefilter.arrays import FloatArray
from safefilter.constraints.margins import (
    NO_MARGINS,
    ROWS_EACH,
    add_fence,
    margins_of,
    own_error,
    spread,
    tilt,
    wall_tilt,
)
from safefilter.constraints.row_buffers import row_buffers
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.jit import source_of
from safefilter.uncertainty import EXACT

DT = 0.2
angles = st.floats(-math.pi, math.pi)
quarter_angles = st.floats(0.0, 1.5)
parts = st.floats(0.0, 1.0)


def fence(angle: float, tilt_angle: float, turn: float, speed: float) -> FloatArray:
    """Rows (3, M) around a direction."""
    rows = row_buffers(1, ROWS_EACH)
    own = type(rows)(rows.array[0], rows.label[0])
    sine = math.sin(tilt_angle)
    count = add_fence(
        own, 0, math.cos(angle), math.sin(angle), sine, math.cos(turn), math.sin(turn), speed
    )
    return own.array[:, :count]


def fastest(rows: FloatArray, x: float, y: float) -> float:
    """Largest speed in a direction that keeps all rows."""
    along = -(rows[0] * x + rows[1] * y)
    limits = [-offset / a for a, offset in zip(along, rows[2], strict=True) if a > 1e-12]
    return min(limits, default=math.inf)


def test_without_errors_there_is_nothing_to_pay() -> None:
    assert margins_of(EXACT, DT, 0.0) == NO_MARGINS
    assert margins_of(EXACT, DT, 3.0) == NO_MARGINS
    assert Separation(DT).rows_each == 1


def test_margins_by_hand() -> None:
    bounds = Uncertainty(position_error=0.01, observation_delay=0.1, actuation_error=0.6)
    found = margins_of(bounds, DT, 0.0)
    # A movement that is off by 3 of 5 is at most asin(3/5) off its course.
    assert found == pytest.approx((0.01, 0.0, 0.1, 1.6, 0.8, 0.6))


def test_a_drive_has_its_heading_as_stale_as_the_rest() -> None:
    bounds = Uncertainty(heading_error=0.1, observation_delay=0.2)
    found = margins_of(bounds, DT, 0.5)
    assert math.atan2(found.turn_sine, found.turn_cosine) == pytest.approx(0.1 + 0.5 * 0.2)
    assert found.gain == 1.0
    # A turn rate that is off by w is as good as an actuation error of w dt / 2.
    rate = 0.3
    worse = Uncertainty(heading_error=0.1, observation_delay=0.2, actuation_error=rate * DT / 2)
    angle = 0.1 + (0.5 + rate) * 0.2 + math.asin(rate * DT / 2 * 0.05 / math.sin(0.05))
    found = margins_of(worse, DT, 0.5)
    assert math.atan2(found.turn_sine, found.turn_cosine) == pytest.approx(angle)
    # Whoever takes any velocity has no heading to be wrong.
    assert margins_of(bounds, DT, 0.0).turn_sine == 0.0


def test_a_drive_that_turns_is_off_by_more_of_its_displacement_than_of_its_way() -> None:
    part, omega_max = 0.1, 3.0
    found = margins_of(Uncertainty(actuation_error=part), DT, omega_max)
    way, turn = 1.0, omega_max * DT
    chord = way * math.sin(turn / 2) / (turn / 2)
    assert found.gain == pytest.approx(1.0 + part * way / chord)


@pytest.mark.parametrize(
    ("bounds", "omega_max", "told"),
    [
        (Uncertainty(heading_error=1.2, observation_delay=0.5), 1.0, "a quarter turn"),
        (Uncertainty(actuation_delay=1.0), 3.0, "half a turn"),
        (Uncertainty(actuation_error=0.99), 12.0, "a quarter turn"),
    ],
)
def test_where_no_direction_is_safe_nothing_is_promised(
    bounds: Uncertainty, omega_max: float, told: str
) -> None:
    drives = DifferentialDrive(0.2, omega_max, DT, 0.01)
    with pytest.raises(OutOfRange, match=told):
        SafetyFilter([Separation(DT, uncertainty=bounds)], drives)


def test_uncertainty_is_of_its_kind() -> None:
    with pytest.raises(InvalidInput, match="uncertainty: expected a Uncertainty, got float"):
        Separation(DT, uncertainty=0.1)  # type: ignore[arg-type]  # what is refused


def test_errors_by_hand() -> None:
    assert own_error(0.01, 0.5, 0.2) == pytest.approx(0.11)
    assert own_error(0.01, 0.0, math.inf) == 0.01
    assert [tilt(5.0, 3.0), tilt(5.0, 0.0), tilt(2.0, 2.0), tilt(0.0, 0.0)] == [0.6, 0.0, 1.0, 0.0]
    # As long as there is a gap to a wall, its line holds.
    assert [wall_tilt(5.0, 4.0, 3.0), wall_tilt(5.0, 6.0, 3.0)] == [0.0, 0.6]


def test_formulas_take_exact_numbers() -> None:
    assert source_of(tilt)(Fraction(5), Fraction(3)) == Fraction(3, 5)  # type: ignore[arg-type]  # on purpose
    assert source_of(own_error)(Fraction(1), Fraction(2), Fraction(3)) == 7  # type: ignore[arg-type]  # on purpose


@given(alpha=quarter_angles, beta=quarter_angles)
def test_spread_adds_angles(alpha: float, beta: float) -> None:
    cosine, sine = spread(math.sin(alpha), math.cos(beta), math.sin(beta))
    assert (cosine, sine) == pytest.approx((math.cos(alpha + beta), math.sin(alpha + beta)))


@given(
    angle=angles,
    alpha=quarter_angles,
    beta=quarter_angles,
    side=st.floats(-1.0, 1.0),
    towards=angles,
)
def test_a_fence_holds_in_every_direction_that_may_be_the_true_one(
    angle: float, alpha: float, beta: float, side: float, towards: float
) -> None:
    rows, gamma = fence(angle, alpha, beta, 1.0), alpha + beta
    true = angle + side * min(gamma, math.pi) if gamma < math.pi / 2 else towards
    if alpha == beta == 0.0:
        true = angle
    speed = fastest(rows, math.cos(towards), math.sin(towards))
    advance = speed * math.cos(true - towards)
    if math.isfinite(speed):
        assert advance <= 1.0 + 1e-9
    else:
        assert math.cos(true - towards) <= 1e-9


@given(alpha=quarter_angles, angle=angles)
def test_a_fence_gives_no_more_away_than_it_must(alpha: float, angle: float) -> None:
    # Straight at the neighbour all of the budget is used, and aside on the rim of the cone, too.
    for towards in (angle, angle + alpha, angle - alpha):
        speed = fastest(fence(angle, alpha, 0.0, 1.0), math.cos(towards), math.sin(towards))
        assert speed == pytest.approx(1.0 if towards == angle else math.cos(alpha))


@given(alpha=quarter_angles, beta=quarter_angles, speed=st.floats(0.0, 10.0))
def test_standing_still_keeps_every_fence(alpha: float, beta: float, speed: float) -> None:
    assert (fence(0.3, alpha, beta, speed)[2] <= 0.0).all()


def test_where_the_direction_says_nothing_a_budget_of_zero_is_standing_still() -> None:
    rows = fence(0.3, math.pi / 2, 0.0, 0.0)
    assert max(fastest(rows, math.cos(a), math.sin(a)) for a in np.arange(0.0, 6.28, 0.01)) == 0.0


def pair(gap: float, **bounds: float) -> tuple[Separation, Scene]:
    scene = Scene.from_world([[0.0, 0.0], [1.0 + gap, 0.0]], np.zeros((2, 2)), 0.5)
    return Separation(DT, 0.0, uncertainty=Uncertainty(**bounds)), scene  # type: ignore[arg-type]  # no messages


def test_rows_by_hand() -> None:
    separation, scene = pair(1.0, position_error=0.3)
    safety = SafetyFilter([separation], Holonomic(10.0))
    rows = safety.half_spaces(scene, np.zeros((2, 2)))
    found = rows.offsets[0, 64:66] * DT, rows.normals[0, 64:66]
    # The vector is off by 0.6 m of 2 m: 0.4 m are certain, half of them for each, in a cone of cosine 0.954.
    cosine = math.sqrt(1.0 - 0.3**2)
    assert found[0] == pytest.approx([-0.2 * cosine] * 2)
    assert found[1] == pytest.approx(np.array([[-cosine, -0.3], [-cosine, 0.3]]))
    assert [rows.describe(0, 64), rows.describe(0, 65)] == ["separation 1"] * 2


def test_a_wall_takes_one_row_while_there_is_a_gap_and_two_without() -> None:
    separation = Separation(DT, 0.0, uncertainty=Uncertainty(position_error=0.1))
    for distance, budget, count in ((0.8, 0.2, 1), (0.55, 0.0, 2)):
        wall = [[[distance, -1.0], [distance, 1.0]]]
        scene = Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.5, walls=wall)
        rows = SafetyFilter([separation], Holonomic(10.0)).half_spaces(scene, np.zeros((1, 2)))
        walls = rows.present[0] & (rows.labels[0, :, 0] == 2)
        assert walls.sum() == count
        assert -rows.offsets[0, walls] * DT == pytest.approx([budget] * count)


def test_commands_that_may_outlast_the_step_are_slower() -> None:
    separation, scene = pair(0.01, actuation_delay=0.1, clock_jitter=0.1)
    rows = SafetyFilter([separation], Holonomic(0.001)).half_spaces(scene, np.zeros((2, 2)))
    # What both may have moved by while the other's command waits, 0.2 s at 1 mm/s each, is not there to be shared.
    certain = 0.01 - 2 * 0.2 * 0.001 * (1 + 1e-6)
    reach = 0.001 * (1 + 1e-6) * (DT + 0.2)
    assert not rows.present[0, 64:].any()
    assert certain / 2 > reach


@given(error=st.floats(0.0, 0.1), delay=st.floats(0.0, 0.3), seed=st.integers(0, 99))
def test_required_reach_counts_what_may_be_wrong(error: float, delay: float, seed: int) -> None:
    bounds = Uncertainty(position_error=error, observation_delay=delay, actuation_error=0.1)
    separation, kinematics = Separation(DT, uncertainty=bounds), Holonomic(1.0)
    rng = np.random.default_rng(seed)
    place = rng.uniform(-2.0, 2.0, (8, 2))
    whole = Scene.from_world(place, np.zeros((8, 2)), 0.1)
    reach = separation.required_reach(whole, kinematics.speed_limit(whole))
    near = Scene.from_world(place, np.zeros((8, 2)), 0.1, reach=reach)
    safety, wanted = SafetyFilter([separation], kinematics), rng.uniform(-1.0, 1.0, (8, 2))
    np.testing.assert_allclose(
        safety.decide(near, wanted).action, safety.decide(whole, wanted).action, atol=1e-9
    )


def test_bounds_of_zero_change_nothing_bit_for_bit() -> None:
    rng = np.random.default_rng(0)
    scene = Scene.from_world(rng.uniform(-1, 1, (9, 2)), rng.uniform(-1, 1, (9, 2)), 0.1)
    wanted = rng.uniform(-1.0, 1.0, (9, 2))
    plain = SafetyFilter([Separation(DT)], Holonomic(1.0)).decide(scene, wanted)
    stated = SafetyFilter([Separation(DT, uncertainty=Uncertainty())], Holonomic(1.0)).decide(
        scene, wanted
    )
    assert (plain.action == stated.action).all()


def test_alone_it_knows_no_speed_limits_and_takes_stale_positions_for_anywhere() -> None:
    separation, scene = pair(100.0, observation_delay=0.1)
    rows = separation.half_spaces(scene, np.zeros((2, 2)), np.arange(2))
    assert rows.present.sum(axis=1).tolist() == [3, 3]
    assert (rows.offsets == 0.0).all()

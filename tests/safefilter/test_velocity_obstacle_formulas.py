"""Each formula and predicate of the velocity obstacle alone: exactly, and at its borders."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from safefilter.constraints.velocity_obstacle import (
    cutoff_boundary,
    cutoff_change,
    encounter,
    faces_cutoff,
    from_cutoff_centre,
    is_left_of_axis,
    is_overlapping,
    left_leg_normal,
    leg_change,
    right_leg_normal,
)
from safefilter.jit import source_of

HEAD_ON, CROSSING, SAME_HEADING = -1, 0, 1
speeds = st.one_of(st.sampled_from((0.0, -1.0, 0.5)), st.floats(-3.0, 3.0))
# Sides 3, 4, 5 and 5, 12, 13, turned and scaled: square roots that are exact.
fractions = st.fractions(min_value=Fraction(1, 50), max_value=50, max_denominator=50)


@given(scale=fractions, turn=fractions, ratio=fractions)
def test_leg_normals_touch_the_disc_exactly(
    scale: Fraction, turn: Fraction, ratio: Fraction
) -> None:
    assume(ratio < 1)
    # Rational points of the circle: cosine and sine from the tangent of the half angle.
    cosine, sine = (1 - turn**2) / (1 + turn**2), 2 * turn / (1 + turn**2)
    radius, leg = scale * (1 - ratio**2) / (1 + ratio**2), scale * 2 * ratio / (1 + ratio**2)
    p = (scale * cosine, scale * sine)
    for normal, side in ((left_leg_normal, 1), (right_leg_normal, -1)):
        n = source_of(normal)(*p, radius, leg, scale**2)  # type: ignore[arg-type]  # exact numbers
        assert n[0] ** 2 + n[1] ** 2 == 1
        # A disc of VO, centre s p and radius s R, touches the leg: n @ p + R = 0, for every s.
        assert n[0] * p[0] + n[1] * p[1] == -radius
        assert side * (p[0] * n[1] - p[1] * n[0]) > 0
        # The leg itself, the normal turned by a quarter towards p, is on the boundary and stays there.
        along = (side * n[1], -side * n[0])
        assert source_of(leg_change)(*along, *n) == 0
        assert along[0] * p[0] + along[1] * p[1] == leg


@given(radius=fractions, horizon=fractions, cosine_parameter=fractions, length=fractions)
def test_cutoff_change_ends_on_the_disc_exactly(
    radius: Fraction, horizon: Fraction, cosine_parameter: Fraction, length: Fraction
) -> None:
    t = cosine_parameter
    direction = ((1 - t**2) / (1 + t**2), 2 * t / (1 + t**2))
    change = source_of(cutoff_change)(radius, horizon, length)  # type: ignore[arg-type]
    after = [(length + change) * part for part in direction]
    assert after[0] ** 2 + after[1] ** 2 == (radius / horizon) ** 2


@given(relative=fractions, velocity=fractions, horizon=fractions)
def test_cutoff_centre_is_the_velocity_that_meets_at_the_horizon(
    relative: Fraction, velocity: Fraction, horizon: Fraction
) -> None:
    w = source_of(from_cutoff_centre)(relative, velocity, horizon)  # type: ignore[arg-type]
    assert (velocity - w) * horizon == relative


@pytest.mark.parametrize(
    ("w", "expected"),
    [
        ((-1.0, 0.0), True),
        ((1.0, 0.0), False),
        ((0.0, 1.0), False),
        ((0.0, 0.0), False),
        ((-0.6, 0.8), False),  # exactly where arc and left leg join
        ((-0.61, 0.79), True),
        ((-0.59, 0.81), False),
    ],
)
def test_arc_ends_where_the_legs_touch_it(w: tuple[float, float], expected: bool) -> None:
    assert faces_cutoff(5.0, 0.0, *w, 3.0) is expected


def test_touching_counts_as_overlapping() -> None:
    assert is_overlapping(4.0, 2.0)
    assert not is_overlapping(math.nextafter(4.0, 5.0), 2.0)


def test_axis_itself_is_not_left_of_it() -> None:
    assert is_left_of_axis(1.0, 0.0, 5.0, 1e-300)
    assert not is_left_of_axis(1.0, 0.0, 5.0, 0.0)
    assert not is_left_of_axis(1.0, 0.0, 5.0, -1.0)


def test_coincident_centres_part_along_the_tie() -> None:
    for tie in (1.0, -1.0):
        assert cutoff_boundary(0.0, 0.0, 0.0, 0.0, 1.0, 0.5, tie) == (tie, 0.0, 2.0)


def test_velocity_at_the_cutoff_centre_turns_away_from_the_neighbour() -> None:
    assert cutoff_boundary(3.0, 4.0, 1.5, 2.0, 1.0, 2.0, 1.0) == (-0.6, -0.8, 0.5)


@pytest.mark.parametrize(
    ("v_i", "v_j", "kind"),
    [
        ((1.0, 0.0), (-2.0, 0.0), HEAD_ON),
        ((1.0, 0.0), (2.0, 0.1), SAME_HEADING),
        ((1.0, 0.0), (0.0, 1.0), CROSSING),
        ((1.0, 0.0), (1.0, 1.0), CROSSING),  # exactly 45 degrees
        ((1.0, 0.0), (1.0, 0.999), SAME_HEADING),
        ((1.0, 0.0), (-1.0, 0.999), HEAD_ON),
        ((0.0, 1.0), (0.0, -2.0), HEAD_ON),
        ((3.0, 4.0), (6.0, 8.0), SAME_HEADING),
        ((0.0, 0.0), (1.0, 0.0), CROSSING),
        ((0.0, 0.0), (0.0, 0.0), CROSSING),
    ],
)
def test_kind_of_an_encounter(
    v_i: tuple[float, float], v_j: tuple[float, float], kind: int
) -> None:
    assert encounter(*v_i, *v_j) == kind
    assert encounter(*v_j, *v_i) == kind


@given(a=st.tuples(speeds, speeds), b=st.tuples(speeds, speeds))
def test_both_robots_see_the_same_kind_of_encounter(
    a: tuple[float, float], b: tuple[float, float]
) -> None:
    assert encounter(*a, *b) == encounter(*b, *a)
    # Turning one velocity round makes head-on of the same heading.
    assert encounter(*a, *b) == -encounter(*a, -b[0], -b[1])

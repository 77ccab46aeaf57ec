"""Normals and changes of the velocity obstacle, against its definition: the union of the discs (p / t, R / t)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from safefilter.constraints.velocity_obstacle import (
    VANISHING,
    leg_boundary,
    nearest_boundary,
    norm_boundary,
)

OVERLAP_HORIZON = 0.25
# Part of the largest speed in play that rounding may take; next to the boundary it decides which side is which.
ROUNDING = 1e-9
# Powers of two scale floats exactly, but for those that are about to vanish.
UNDERFLOW = 1e-290
HEAD_ON, CROSSING, SAME_HEADING = -1, 0, 1
# The oracle tries this many normals, so its minimum is too high by up to half the square of their spacing.
NUM_NORMALS = 4001
SPACING = 2.0 * math.pi / (NUM_NORMALS - 1)


class Pair(NamedTuple):
    """Relative position, relative velocity, combined radius, time horizon."""

    p_x: float
    p_y: float
    v_x: float
    v_y: float
    combined_radius: float
    horizon: float

    @property
    def distance(self) -> float:
        return math.hypot(self.p_x, self.p_y)

    @property
    def scale(self) -> float:
        """The largest speed in play: that which rounding is measured against."""
        reach = (self.distance + self.combined_radius) / self.horizon
        return math.hypot(self.v_x, self.v_y) + reach

    def swapped(self) -> Pair:
        """The pair as the other robot sees it."""
        return self._replace(p_x=-self.p_x, p_y=-self.p_y, v_x=-self.v_x, v_y=-self.v_y)

    def mirrored(self) -> Pair:
        return self._replace(p_y=-self.p_y, v_y=-self.v_y)

    def turned(self) -> Pair:
        """The pair after a quarter turn, which is exact in floats."""
        return self._replace(p_x=-self.p_y, p_y=self.p_x, v_x=-self.v_y, v_y=self.v_x)


class Boundary(NamedTuple):
    n_x: float
    n_y: float
    change: float

    def along(self, x: float, y: float) -> float:
        return self.n_x * x + self.n_y * y


def boundary(pair: Pair, tie: float = 1.0, overlap_horizon: float = OVERLAP_HORIZON) -> Boundary:
    return Boundary(*nearest_boundary(*pair, overlap_horizon, tie))


def boundary_by_norm(pair: Pair, kind: int, tie: float = 1.0) -> Boundary:
    return Boundary(*norm_boundary(*pair, OVERLAP_HORIZON, tie, kind))


def time_of_contact(pair: Pair) -> float:
    """First t at which |p - v t| = R, for discs that are apart; infinite if there is none."""
    speed_squared = pair.v_x**2 + pair.v_y**2
    closing = pair.p_x * pair.v_x + pair.p_y * pair.v_y
    free = pair.distance**2 - pair.combined_radius**2
    discriminant = closing**2 - speed_squared * free
    if closing <= 0.0 or discriminant < 0.0:
        return math.inf
    return free / (closing + math.sqrt(discriminant))


def change_by_definition(pair: Pair) -> float:
    """Signed distance to the boundary of a convex set: the least of ``h(n) - n @ v`` over its normals n.

    ``h(n) = max s * (n @ p + R)`` over ``s = 1 / t >= 1 / horizon``: infinite where ``n @ p > -R``. The two extreme
    normals and all between them are tried.
    """
    axis = math.atan2(-pair.p_y, -pair.p_x)
    half = math.acos(min(1.0, pair.combined_radius / pair.distance))
    angle = axis + np.linspace(-half, half, NUM_NORMALS)
    n_x, n_y = np.cos(angle), np.sin(angle)
    support = (n_x * pair.p_x + n_y * pair.p_y + pair.combined_radius) / pair.horizon
    return float((support - n_x * pair.v_x - n_y * pair.v_y).min())


def distance_by_discs(pair: Pair) -> float:
    """Distance of a velocity outside VO: the least one to a disc (s p, s R), a convex function of s = 1 / t."""

    def distance(s: float) -> float:
        return (
            math.hypot(pair.v_x - s * pair.p_x, pair.v_y - s * pair.p_y) - s * pair.combined_radius
        )

    low, high = 1.0 / pair.horizon, 1.0 / pair.horizon
    step = pair.scale / pair.distance
    while distance(high + step) < distance(high):
        high, step = high + step, 2.0 * step
    high += step
    for _ in range(200):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, right) if distance(left) < distance(right) else (left, high)
    return distance(low)


coordinates = st.floats(-10.0, 10.0)
speeds = st.one_of(st.sampled_from((0.0, -1.0, 0.5)), st.floats(-3.0, 3.0))
horizons = st.floats(0.1, 10.0)
kinds = st.sampled_from((HEAD_ON, CROSSING, SAME_HEADING))
ties = st.sampled_from((1.0, -1.0))


@st.composite
def apart(draw: st.DrawFn) -> Pair:
    """Discs that do not touch; velocities anywhere, on the axis, or at the centre of a disc of VO."""
    radius = draw(st.floats(1e-3, 2.0))
    distance = radius * (1.0 + draw(st.floats(1e-6, 1e3)))
    angle = draw(st.floats(0.0, 2.0 * math.pi))
    p_x, p_y = distance * math.cos(angle), distance * math.sin(angle)
    horizon = draw(horizons)
    kind = draw(st.sampled_from(("any", "scaled", "axis", "disc")))
    if kind == "any":
        v_x, v_y = draw(speeds), draw(speeds)
    elif kind == "scaled":
        v_x, v_y = draw(speeds) * distance / horizon, draw(speeds) * distance / horizon
    elif kind == "axis":
        share = draw(st.floats(-2.0, 4.0))
        v_x, v_y = share * p_x / horizon, share * p_y / horizon
    else:
        s = (1.0 + draw(st.floats(0.0, 3.0))) / horizon
        v_x = s * p_x + draw(st.floats(-1.5, 1.5)) * s * radius
        v_y = s * p_y + draw(st.floats(-1.5, 1.5)) * s * radius
    return Pair(p_x, p_y, v_x, v_y, radius, horizon)


@st.composite
def overlapping(draw: st.DrawFn) -> Pair:
    """Discs that overlap, coincident centres among them."""
    radius = draw(st.floats(1e-3, 2.0))
    distance = radius * draw(st.one_of(st.just(0.0), st.floats(0.0, 0.99)))
    angle = draw(st.floats(0.0, 2.0 * math.pi))
    p_x, p_y = distance * math.cos(angle), distance * math.sin(angle)
    return Pair(p_x, p_y, draw(speeds), draw(speeds), radius, draw(horizons))


@st.composite
def anywhere(draw: st.DrawFn) -> Pair:
    """Any numbers that are not huge: zeros, numbers whose squares vanish, radii from 1 um to 1 km."""
    numbers = st.one_of(
        st.sampled_from((0.0, -0.0, 1e-3, 5e-324, 2e-162, 1e-160)), st.floats(-1e4, 1e4)
    )
    p_x, p_y, v_x, v_y = (draw(numbers) for _ in range(4))
    return Pair(p_x, p_y, v_x, v_y, draw(st.floats(1e-6, 1e3)), draw(horizons))


pairs = st.one_of(apart(), overlapping())


# By hand: discs with sides 3, 4, 5.
APART = Pair(5.0, 0.0, 0.0, 0.0, 3.0, 5.0)
BY_HAND = [
    pytest.param(APART._replace(v_x=0.75), (-1.0, 0.0, 0.35), id="cut-off, inside"),
    pytest.param(APART._replace(v_x=0.25), (-1.0, 0.0, -0.15), id="cut-off, outside"),
    pytest.param(APART._replace(v_x=2.0, v_y=0.5), (-0.6, 0.8, 0.8), id="left leg, inside"),
    pytest.param(APART._replace(v_x=2.0, v_y=-0.5), (-0.6, -0.8, 0.8), id="right leg, inside"),
    pytest.param(APART._replace(v_x=1.0, v_y=3.0), (-0.6, 0.8, -1.8), id="left leg, outside"),
    pytest.param(APART._replace(v_x=1.0, v_y=-3.0), (-0.6, -0.8, -1.8), id="right leg, outside"),
    pytest.param(APART._replace(v_x=4.0), (-0.6, -0.8, 2.4), id="on the axis: the right leg"),
    pytest.param(APART._replace(v_x=1.0), (-0.6, -0.8, 0.6), id="at the centre: the right leg"),
    pytest.param(Pair(1.0, 0.0, 0.0, 0.0, 2.0, 9.0), (-1.0, 0.0, 4.0), id="overlap"),
    pytest.param(Pair(2.0, 0.0, 0.0, 0.0, 2.0, 9.0), (-1.0, 0.0, 0.0), id="touching, at rest"),
    pytest.param(Pair(2.0, 0.0, 8.0, 0.0, 2.0, 9.0), (-1.0, 0.0, 8.0), id="touching, at centre"),
    pytest.param(Pair(0.0, 0.0, 0.0, 3.0, 2.0, 9.0), (0.0, 1.0, 5.0), id="same centres, parting"),
    pytest.param(Pair(0.0, 0.0, 0.0, 0.0, 2.0, 9.0), (1.0, 0.0, 8.0), id="same centres, at rest"),
]


@pytest.mark.parametrize(("pair", "expected"), BY_HAND)
def test_each_branch_by_hand(pair: Pair, expected: tuple[float, float, float]) -> None:
    assert boundary(pair) == pytest.approx(expected, abs=1e-15)


def test_overlap_uses_its_own_horizon() -> None:
    pair = Pair(1.0, 0.0, 0.0, 0.0, 2.0, 9.0)
    assert [boundary(pair, overlap_horizon=h).change for h in (0.25, 0.5, 1.0)] == [4.0, 2.0, 1.0]


@given(pair=apart())
def test_change_is_the_signed_distance_to_the_boundary(pair: Pair) -> None:
    found, expected = boundary(pair).change, change_by_definition(pair)
    # Where discs nearly touch, all of the arc lies within a tiny angle and both lose half of the digits.
    blur = 1e-7 * pair.scale
    assert expected - pair.scale * SPACING**2 - blur <= found <= expected + blur


@given(pair=apart())
def test_change_outside_is_the_distance_to_the_nearest_disc(pair: Pair) -> None:
    found = boundary(pair)
    assume(found.change < -ROUNDING * pair.scale)
    assert -found.change == pytest.approx(distance_by_discs(pair), abs=1e-7 * pair.scale)


@given(pair=apart())
def test_change_is_positive_exactly_inside(pair: Pair) -> None:
    change = boundary(pair).change
    assume(abs(change) > 1e-7 * pair.scale)
    assert (change > 0.0) == (time_of_contact(pair) < pair.horizon)


@given(pair=overlapping())
def test_overlapping_discs_part_within_the_overlap_horizon(pair: Pair) -> None:
    found = boundary(pair)
    parted_x = pair.p_x - OVERLAP_HORIZON * (pair.v_x + found.change * found.n_x)
    parted_y = pair.p_y - OVERLAP_HORIZON * (pair.v_y + found.change * found.n_y)
    assert math.hypot(parted_x, parted_y) == pytest.approx(
        pair.combined_radius, abs=ROUNDING * pair.scale
    )


@given(pair=pairs)
def test_velocity_after_the_change_lies_on_the_boundary(pair: Pair) -> None:
    found = boundary(pair)
    v_x, v_y = pair.v_x + found.change * found.n_x, pair.v_y + found.change * found.n_y
    again = boundary(pair._replace(v_x=v_x, v_y=v_y)).change
    assert again == pytest.approx(0.0, abs=1e-7 * pair.scale)


@given(pair=pairs, kind=kinds, outwards=st.floats(0.0, 5.0), sideways=st.floats(-5.0, 5.0))
def test_no_permitted_relative_velocity_is_inside(
    pair: Pair, kind: int, outwards: float, sideways: float
) -> None:
    found = boundary_by_norm(pair, kind)
    advance = found.change + outwards
    permitted = pair._replace(
        v_x=pair.v_x + advance * found.n_x - sideways * found.n_y,
        v_y=pair.v_y + advance * found.n_y + sideways * found.n_x,
    )
    assert boundary(permitted).change <= 1e-7 * (pair.scale + permitted.scale)


@given(
    pair=apart(),
    kind=kinds,
    share=st.floats(1e-3, 1.0),
    part=st.floats(0.0, 1.0),
    angle=st.floats(0.0, 6.3),
)
def test_half_plane_supports_the_velocity_obstacle(
    pair: Pair, kind: int, share: float, part: float, angle: float
) -> None:
    found = boundary_by_norm(pair, kind)
    time = share * pair.horizon
    x = (pair.p_x + part * pair.combined_radius * math.cos(angle)) / time
    y = (pair.p_y + part * pair.combined_radius * math.sin(angle)) / time
    blur = 1e-7 * (pair.scale + math.hypot(x, y))
    assert found.along(x - pair.v_x, y - pair.v_y) <= found.change + blur


@given(pair=anywhere(), kind=kinds, tie=ties)
@example(pair=Pair(0.0, 0.0, 2e-162, 0.0, 1.0, 2.0), kind=CROSSING, tie=1.0)
@example(pair=Pair(2e-162, 0.0, 2e-162 / 0.25, 0.0, 1.0, 2.0), kind=CROSSING, tie=1.0)
@example(pair=Pair(1.0, 0.0, 0.5, 0.0, 0.5, 2.0), kind=CROSSING, tie=1.0)
def test_normals_have_length_one_whatever_comes(pair: Pair, kind: int, tie: float) -> None:
    found = boundary_by_norm(pair, kind, tie)
    assert math.isfinite(found.change)
    assert math.hypot(found.n_x, found.n_y) == pytest.approx(1.0, abs=1e-12)


@given(pair=anywhere(), kind=kinds)
def test_both_robots_see_opposite_normals_and_the_same_change(pair: Pair, kind: int) -> None:
    mine, theirs = boundary_by_norm(pair, kind), boundary_by_norm(pair.swapped(), kind, -1.0)
    assert theirs == (-mine.n_x, -mine.n_y, mine.change)


@given(pair=pairs)
def test_mirror_image_exchanges_the_legs(pair: Pair) -> None:
    w_x, w_y = pair.v_x - pair.p_x / pair.horizon, pair.v_y - pair.p_y / pair.horizon
    assume(pair.p_x * w_y != pair.p_y * w_x)
    found, mirrored = boundary(pair), boundary(pair.mirrored())
    assert mirrored == (found.n_x, -found.n_y, found.change)


@given(pair=pairs)
def test_quarter_turn_turns_the_normal(pair: Pair) -> None:
    assume(pair.distance > VANISHING)
    found, turned = boundary(pair), boundary(pair.turned())
    assert turned == (-found.n_y, found.n_x, found.change)


@given(pair=apart(), power=st.integers(-6, 6))
def test_length_scales_the_change(pair: Pair, power: int) -> None:
    unit = 2.0**power
    larger = Pair._make([*(unit * number for number in pair[:5]), pair.horizon])
    found, scaled = boundary(pair), boundary(larger)
    assert scaled == pytest.approx(
        (found.n_x, found.n_y, unit * found.change), rel=0.0, abs=UNDERFLOW
    )


@given(pair=apart(), power=st.integers(-6, 6))
def test_slow_motion_scales_the_change(pair: Pair, power: int) -> None:
    unit = 2.0**power
    slower = pair._replace(v_x=pair.v_x / unit, v_y=pair.v_y / unit, horizon=unit * pair.horizon)
    found, scaled = boundary(pair), boundary(slower)
    assert scaled == pytest.approx(
        (found.n_x, found.n_y, found.change / unit), rel=0.0, abs=UNDERFLOW
    )


@given(pair=apart(), longer=st.floats(1.0, 10.0))
def test_longer_horizon_never_permits_more(pair: Pair, longer: float) -> None:
    later = pair._replace(horizon=longer * pair.horizon)
    assert boundary(later).change >= boundary(pair).change - 1e-7 * pair.scale


@given(pair=apart(), is_left=st.booleans())
def test_nearest_boundary_is_never_further_than_a_leg(pair: Pair, is_left: bool) -> None:
    p_x, p_y, v_x, v_y, radius, _ = pair
    leg = Boundary(*leg_boundary(p_x, p_y, v_x, v_y, radius, is_left))
    assert boundary(pair).change <= leg.change + 1e-7 * pair.scale


@pytest.mark.parametrize(("kind", "normal"), [(HEAD_ON, (-0.6, -0.8)), (SAME_HEADING, (-0.6, 0.8))])
@pytest.mark.parametrize("v_y", [0.5, -0.5])
def test_norms_choose_the_leg_whatever_is_nearer(
    kind: int, normal: tuple[float, float], v_y: float
) -> None:
    pair = APART._replace(v_x=2.0, v_y=v_y)
    found = boundary_by_norm(pair, kind)
    assert boundary_by_norm(pair.turned(), kind) == (-found.n_y, found.n_x, found.change)
    assert found == pytest.approx((*normal, -2.0 * normal[0] - v_y * normal[1]), abs=1e-15)


@given(pair=pairs, kind=kinds)
def test_norms_change_nothing_outside_or_in_overlap(pair: Pair, kind: int) -> None:
    found = boundary(pair)
    assume(found.change <= 0.0 or pair.distance <= pair.combined_radius)
    assert boundary_by_norm(pair, kind) == found


@given(pair=apart())
def test_crossings_have_no_preferred_side(pair: Pair) -> None:
    assert boundary_by_norm(pair, CROSSING) == boundary(pair)

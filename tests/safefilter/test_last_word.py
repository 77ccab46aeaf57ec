"""The last word on a holonomic velocity: budgets and speed limit hold exactly on whatever it is given.

Rows are (n_x, n_y, offset) with ``offset <= 0``: ``n @ v >= offset``.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.jit import kernel
from safefilter.kinematics.last_word import (
    DOUBLE_ULP,
    PUSHED_PART,
    SINGLE_ULP,
    cast,
    keeps_budgets,
    largest_scale,
    last_word,
)

Row = tuple[float, float, float]
LIMIT = 0.2
WALL_AHEAD: Row = (-1.0, 0.0, 0.0)


def columns(rows: list[Row]) -> FloatArray:
    """Rows as kernels take them, shape (3, M)."""
    return np.array(rows, dtype=np.float64).reshape(-1, 3).T.copy()


def said(
    rows: list[Row], x: float, y: float, *, limit: float = LIMIT, is_single: bool = False
) -> tuple[float, float]:
    return last_word(columns(rows), 0, len(rows), limit, x, y, is_single)


def keeps(rows: list[Row], x: float, y: float, limit: float = LIMIT) -> bool:
    return keeps_budgets(columns(rows), 0, len(rows), limit, x, y)


def is_exactly_kept(rows: list[Row], x: float, y: float, limit: float) -> bool:
    """As `keeps_budgets`, in floats of Python: what a reader of the rows computes."""
    return x * x + y * y <= limit * limit and all(
        offset - (n_x * x + n_y * y) <= 0.0 for n_x, n_y, offset in rows
    )


unit_rows = st.builds(
    lambda angle, offset: (math.cos(angle), math.sin(angle), offset),
    st.one_of(st.floats(0.0, 6.3), st.integers(0, 8).map(lambda k: k * math.pi / 4.0)),
    st.one_of(
        st.just(0.0), st.just(-0.0), st.floats(-1.0, 0.0), st.floats(-1e-9, 0.0), st.just(-1e300)
    ),
)
awkward_rows = st.lists(unit_rows, max_size=8)
anything = st.one_of(
    st.floats(),
    st.floats(-0.3, 0.3),
    st.sampled_from([0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e300, -1e300, math.inf, math.nan, 0.2]),
)
limits = st.one_of(st.just(LIMIT), st.floats(1e-6, 1e3))


@example(rows=[WALL_AHEAD], x=1e300, y=1e300, limit=LIMIT, is_single=True)
@example(rows=[(1.0, 0.0, -0.0)], x=-5e-324, y=0.2, limit=LIMIT, is_single=False)
@given(rows=awkward_rows, x=anything, y=anything, limit=limits, is_single=st.booleans())
def test_whatever_it_is_given_every_budget_and_the_limit_hold_exactly(
    rows: list[Row], x: float, y: float, limit: float, is_single: bool
) -> None:
    with np.errstate(all="ignore"):  # interpreted kernels would warn of what overflows
        done = said(rows, x, y, limit=limit, is_single=is_single)
    assert is_exactly_kept(rows, *done, limit)
    assert keeps(rows, *done, limit)
    if is_single:
        assert [float(np.float32(value)) for value in done] == list(done)


@given(rows=awkward_rows, x=anything, y=anything, is_single=st.booleans())
def test_what_keeps_everything_comes_back_bit_for_bit(
    rows: list[Row], x: float, y: float, is_single: bool
) -> None:
    with np.errstate(all="ignore"):
        x, y = cast(x, is_single), cast(y, is_single)
        scaled = (
            0.7 * LIMIT / max(1.0, math.hypot(x, y)) if math.isfinite(math.hypot(x, y)) else 0.0
        )
        for wish in ((x, y), (cast(scaled * x, is_single), cast(scaled * y, is_single))):
            if keeps(rows, *wish):
                done = said(rows, *wish, is_single=is_single)
                assert np.array(done).tobytes() == np.array(wish).tobytes()


@given(rows=awkward_rows, x=anything, y=anything, is_single=st.booleans())
def test_said_twice_it_says_the_same(rows: list[Row], x: float, y: float, is_single: bool) -> None:
    with np.errstate(all="ignore"):
        once = said(rows, x, y, is_single=is_single)
        assert said(rows, *once, is_single=is_single) == once


@given(
    rows=awkward_rows,
    angle=st.floats(0.0, 6.3),
    speed=st.floats(0.0, 5.0),
    is_single=st.booleans(),
)
def test_the_movement_is_never_longer_than_asked_but_for_the_push_off_a_row(
    rows: list[Row], angle: float, speed: float, is_single: bool
) -> None:
    done = said(rows, speed * math.cos(angle), speed * math.sin(angle), is_single=is_single)
    # Pushes are for shortfalls of rounding's size: each is at most twice one of them.
    push = 2.0 * PUSHED_PART * LIMIT + 2.0**9 * SINGLE_ULP * LIMIT
    assert math.hypot(*done) <= min(speed, LIMIT) + 8.0 * push


@pytest.mark.parametrize(("is_single", "ulp"), [(False, DOUBLE_ULP), (True, SINGLE_ULP)])
@given(angle=st.floats(0.0, 6.3), speed=st.floats(1e-3, 0.199), off=st.floats(-4.0, 4.0))
def test_a_robot_in_contact_slides_along_at_full_speed(
    is_single: bool, ulp: float, angle: float, speed: float, off: float
) -> None:
    # Straight along the row, but for a few units in the last place to either side.
    n_x, n_y = math.cos(angle), math.sin(angle)
    x, y = -speed * n_y + off * ulp * speed * n_x, speed * n_x + off * ulp * speed * n_y
    done = said([(n_x, n_y, 0.0)], x, y, is_single=is_single)
    assert done == pytest.approx((x, y), abs=60.0 * ulp * speed)


@pytest.mark.parametrize("is_single", [False, True])
def test_between_two_touching_robots_a_robot_slides_out(is_single: bool) -> None:
    # One on the left and one on the right: the passage has no width to spare, the way ahead is free.
    done = said([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)], 0.0, 0.15, is_single=is_single)
    assert done[0] == 0.0
    assert done[1] == pytest.approx(0.15, abs=1e-8)


@pytest.mark.parametrize("is_single", [False, True])
@given(
    opening=st.floats(1e-3, 3.0),
    angle=st.floats(0.0, 6.3),
    speed=st.floats(0.01, 0.19),
    place=st.integers(0, 1),
)
# In contact with one robot, and held by the budget of another that is almost opposite: a push off either one is a
# push into the other.
@example(opening=0.01, angle=1.0, speed=0.1, place=0)
def test_in_the_corner_of_two_budgets_a_robot_keeps_moving(
    opening: float, angle: float, speed: float, place: int, is_single: bool
) -> None:
    x, y = speed * math.cos(angle), speed * math.sin(angle)
    touched = (-math.sin(angle), math.cos(angle), 0.0)
    across = angle + math.pi / 2.0 + math.pi - opening
    n_x, n_y = math.cos(across), math.sin(across)
    # The second budget holds with equality: a row with an offset <= 0 that the velocity ends on.
    offset = n_x * x + n_y * y
    assume(offset <= -1e-3)
    rows: list[Row] = [touched, (n_x, n_y, offset)]
    done = said(rows[::-1] if place else rows, x, y, is_single=is_single)
    assert math.hypot(done[0] - x, done[1] - y) <= (2e-4 if is_single else 1e-9)


@given(angle=st.floats(0.0, 6.3), away=st.floats(0.01, 3.1), speed=st.floats(1e-9, 0.199))
def test_a_robot_in_contact_may_part(angle: float, away: float, speed: float) -> None:
    row = (math.cos(angle), math.sin(angle), 0.0)
    course = angle - math.pi / 2.0 + away
    x, y = speed * math.cos(course), speed * math.sin(course)
    if row[0] * x + row[1] * y > 0.0:
        assert said([row], x, y) == (x, y)


@pytest.mark.parametrize("budget", [0.0, 1e-12, 1e-3, 0.1])
@pytest.mark.parametrize("is_single", [False, True])
def test_a_push_far_over_budget_is_scaled_along_its_course(budget: float, is_single: bool) -> None:
    done = said([(-1.0, 0.0, -budget)], 0.15, 0.05, is_single=is_single)
    scale = budget / 0.15 if budget < 0.15 else 1.0
    assert done[0] <= budget
    assert done == pytest.approx((scale * 0.15, scale * 0.05), rel=1e-5, abs=1e-15)


def test_the_speed_limit_alone_scales_along_the_course() -> None:
    x, y = said([], 3.0, 4.0)
    assert math.hypot(x, y) == pytest.approx(LIMIT, rel=1e-12)
    assert x / y == pytest.approx(0.75, rel=1e-12)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_velocity_stands_still(value: float) -> None:
    assert said([WALL_AHEAD], value, 0.1) == (0.0, 0.0)
    assert said([WALL_AHEAD], 0.1, value) == (0.0, 0.0)
    with np.errstate(invalid="ignore"):  # zero times infinity, where kernels are interpreted
        assert not keeps([], value, 0.1)
        assert not keeps([WALL_AHEAD], 0.1, value)


def test_a_number_too_large_for_float32_stands_still_as_float32() -> None:
    with np.errstate(all="ignore"):
        assert said([], 1e300, 0.0, is_single=True) == (0.0, 0.0)


def test_rows_outside_of_the_range_are_not_asked() -> None:
    rows = columns([WALL_AHEAD, (0.0, -1.0, 0.0), WALL_AHEAD])
    assert last_word(rows, 1, 2, LIMIT, 0.1, -0.1, False) == (0.1, -0.1)
    assert last_word(rows, 1, 1, LIMIT, 0.1, 0.1, False) == (0.1, 0.1)


@given(rows=awkward_rows, angle=st.floats(0.0, 6.3), speed=st.floats(1e-3, 5.0))
def test_the_scale_is_the_largest_that_keeps_everything(
    rows: list[Row], angle: float, speed: float
) -> None:
    x, y = speed * math.cos(angle), speed * math.sin(angle)
    scale = largest_scale(columns(rows), 0, len(rows), LIMIT, x, y)
    assert 0.0 <= scale <= 1.0
    slacks = [scale * (n_x * x + n_y * y) - offset for n_x, n_y, offset in rows]
    slacks.append(LIMIT - scale * speed)
    assert min(slacks) >= -1e-15
    if scale < 1.0:
        assert min(slacks) <= 1e-15


@kernel
def worst_of_many(
    rows: FloatArray, wishes: FloatArray, limit: float, is_single: bool
) -> tuple[int, float]:
    """Number of last words that break something, and the least part of a tangential speed that was kept."""
    broken, kept = 0, 1.0
    for k in range(len(wishes)):
        x, y = last_word(rows[k], 0, rows.shape[2], limit, wishes[k, 0], wishes[k, 1], is_single)
        if not keeps_budgets(rows[k], 0, rows.shape[2], limit, x, y):
            broken += 1
        asked = math.sqrt(wishes[k, 0] ** 2 + wishes[k, 1] ** 2)
        kept = min(kept, math.sqrt(x * x + y * y) / asked)
    return broken, kept


@pytest.mark.stress
@pytest.mark.parametrize("is_single", [False, True])
@pytest.mark.parametrize("num_rows", [1, 6, 60])
def test_of_a_million_last_words_none_breaks_a_budget(is_single: bool, num_rows: int) -> None:
    rng = np.random.default_rng(num_rows)
    for size in (1e-12, 1e-3, 1.0, 1e6):
        angle = rng.uniform(0.0, 2.0 * np.pi, (40_000, num_rows))
        offset = -rng.choice([0.0, 1e-12, 1e-6, 0.1, 1.0], angle.shape)
        rows = np.stack([np.cos(angle), np.sin(angle), offset], axis=1)
        broken, _ = worst_of_many(rows, rng.normal(size=(40_000, 2)) * size, LIMIT, is_single)
        assert broken == 0


@pytest.mark.stress
@pytest.mark.parametrize("is_single", [False, True])
def test_of_a_hundred_thousand_robots_in_contact_none_is_stopped_for_rounding(
    is_single: bool,
) -> None:
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 2.0 * np.pi, (100_000, 1))
    rows = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    speed = 10.0 ** rng.uniform(-6.0, -0.7, 100_000)
    wishes = speed[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])
    broken, kept = worst_of_many(rows, wishes, LIMIT, is_single)
    assert broken == 0
    assert kept >= 1.0 - 1e-5

"""The last word in space: what executes keeps every budget exactly, and is all but what was solved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.jit import kernel
from safefilter.kinematics.last_word import last_word
from safefilter.kinematics.last_word_in_space import last_word_in_space

LIMIT = 1.0
NO_ROWS = np.zeros((4, 0))


@kernel
def speak(rows: FloatArray, limit: float, velocity: FloatArray, is_single: bool) -> None:
    last_word_in_space(rows, 0, rows.shape[1], limit, velocity, is_single)


@kernel
def speak_in_plane(
    rows: FloatArray, limit: float, x: float, y: float, is_single: bool
) -> tuple[float, float]:
    return last_word(rows, 0, rows.shape[1], limit, x, y, is_single)


def spoken(rows: FloatArray, velocity: FloatArray, *, is_single: bool = False) -> FloatArray:
    out = velocity.astype(np.float64)
    speak(rows, LIMIT, out, is_single)
    return out


def random_rows(rng: np.random.Generator, size: int, dimension: int) -> FloatArray:
    normals = rng.normal(size=(dimension, size))
    normals /= np.linalg.norm(normals, axis=0)
    offsets = -rng.choice((0.0, 1e-9, 0.1, 1.0), size) * rng.uniform(size=size)
    return np.concatenate([normals, offsets[None]])


@given(seed=st.integers(0, 9999), size=st.integers(0, 8), is_single=st.booleans())
def test_every_budget_holds_exactly(seed: int, size: int, is_single: bool) -> None:
    rng = np.random.default_rng(seed)
    rows = random_rows(rng, size, 3)
    out = spoken(rows, 2.0 * rng.normal(size=3), is_single=is_single)
    # In the very order of the kernel's own sums.
    for k in range(size):
        total = 0.0
        for c in range(3):
            total += rows[c, k] * out[c]
        assert total >= rows[3, k]
    assert out[0] * out[0] + out[1] * out[1] + out[2] * out[2] <= LIMIT * LIMIT
    if is_single:
        assert (out == out.astype(np.float32)).all()


@given(seed=st.integers(0, 9999))
def test_what_is_permitted_goes_through_bit_for_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocity = 0.1 * rng.normal(size=3)
    velocity *= min(1.0, 0.9 * LIMIT / float(np.linalg.norm(velocity)))
    rows = random_rows(rng, 5, 3)
    rows[3] = np.minimum(rows[3], rows[:3].T @ velocity - 1e-12)
    assert (spoken(rows, velocity) == velocity).all()


@given(seed=st.integers(0, 9999), is_single=st.booleans())
def test_a_velocity_on_its_rows_is_pushed_and_not_cut(seed: int, is_single: bool) -> None:
    # In contact with two others, it slides along both.
    rng = np.random.default_rng(seed)
    normals = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rows = np.concatenate([normals[:2].T, np.zeros((1, 2))])
    along = 0.9 * LIMIT * normals[2]
    out = spoken(rows, along, is_single=is_single)
    assert float(np.linalg.norm(out - along)) <= (1e-6 if is_single else 1e-14)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_stands_still(wrong: float) -> None:
    assert spoken(NO_ROWS, np.array([0.1, wrong, 0.2])).tolist() == [0.0, 0.0, 0.0]


def test_too_fast_is_slowed_down_in_its_direction() -> None:
    np.testing.assert_allclose(spoken(NO_ROWS, np.array([2.0, 3.0, 6.0])), np.array([2, 3, 6]) / 7)


@given(seed=st.integers(0, 9999), size=st.integers(0, 6), is_single=st.booleans())
def test_with_two_dimensions_it_is_the_last_word_of_the_plane(
    seed: int, size: int, is_single: bool
) -> None:
    rng = np.random.default_rng(seed)
    rows, velocity = random_rows(rng, size, 2), 2.0 * rng.normal(size=2)
    expected = speak_in_plane(rows, LIMIT, velocity[0], velocity[1], is_single)
    np.testing.assert_allclose(spoken(rows, velocity, is_single=is_single), expected, rtol=1e-14)

"""Case-3 in space: t* by hand, against the exact linear program, and with its proof."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.exact_backend import Exact
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, STALLED, Rows
from safefilter.backends.space_kernel import make_held, make_room, project
from safefilter.backends.space_kernel_checks import is_nearest, is_proof
from safefilter.backends.space_kernel_least_violation import least_violation
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import kernel
from safefilter.programs.least_violation import least_violation as least_violation_program
from safefilter.programs.nearest_velocity import nearest_velocity

TOLERANCE = 1e-9
CUBE = np.hstack([np.concatenate([np.eye(3), -np.eye(3)]), np.full((6, 1), -0.5)])
RADIUS = 1.0


class Answer(NamedTuple):
    status: int
    point: FloatArray
    least: float
    relaxation: float
    is_nearest: bool
    is_proved: bool


@kernel
def solve(
    array: FloatArray, num_hard: int, wanted: FloatArray
) -> tuple[int, FloatArray, float, float, bool, bool]:
    size = len(wanted)
    rows = Rows(array, array.shape[1], num_hard, 0, 0.0)
    held, proof, room = make_held(size), make_held(size), make_room(size, array.shape[1])
    least, relaxation, proof_count = 0.0, 0.0, 0
    status, count = project(rows, 0.0, wanted, TOLERANCE, held, proof.rows, 0, room)
    if status == CONTRADICTION:
        status, count, least, relaxation, proof_count = least_violation(
            rows, wanted, TOLERANCE, held, count, proof, room
        )
    point = room.point.copy()
    near = is_nearest(rows, relaxation, wanted, point, TOLERANCE, held, count, room)
    proved = is_proof(rows, least, RADIUS, TOLERANCE, proof, proof_count, room.rest)
    return status, point, least, relaxation, near, proved


def answer(soft: FloatArray, wanted: FloatArray, hard: FloatArray = CUBE) -> Answer:
    rows = np.concatenate([hard, soft])
    return Answer(*solve(rows.T.copy(), len(hard), wanted))


def half_spaces(hard: FloatArray, soft: FloatArray) -> HalfSpaces:
    rows = np.concatenate([hard, soft])
    return HalfSpaces(
        normals=rows[None, :, :3].copy(),
        offsets=rows[None, :, 3].copy(),
        hard=(np.arange(len(rows)) < len(hard))[None],
        present=np.ones((1, len(rows)), dtype=np.bool_),
        labels=np.zeros((1, len(rows), 2), dtype=np.int64),
        sources=("drawn",),
    )


def unit_rows(rng: np.random.Generator, size: int, offset: float) -> FloatArray:
    normals = rng.normal(size=(size, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.hstack([normals, offset + rng.uniform(-0.1, 0.1, (size, 1))])


def test_two_opposite_rows_meet_half_way() -> None:
    soft = np.array([[0.0, 0.0, 1.0, 0.3], [0.0, 0.0, -1.0, -0.1]])
    found = answer(soft, np.array([0.2, 0.1, 0.0]))
    assert found.status == SOLVED
    assert found.least == pytest.approx(0.1, abs=1e-12)
    np.testing.assert_allclose(found.point, [0.2, 0.1, 0.2], atol=2e-9)
    assert found.is_nearest
    assert found.is_proved


def test_four_rows_of_a_tetrahedron_meet_in_its_middle() -> None:
    normals = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
    found = answer(np.hstack([normals, np.full((4, 1), 0.2)]), np.array([0.3, 0.4, -0.1]))
    assert found.least == pytest.approx(0.2, abs=1e-12)
    np.testing.assert_allclose(found.point, 0.0, atol=1e-8)
    assert found.is_proved


def test_a_soft_row_beyond_the_hard_ones_is_violated_by_what_is_missing() -> None:
    found = answer(np.array([[1.0, 0.0, 0.0, 0.75]]), np.array([0.0, 0.3, 0.0]))
    assert found.least == pytest.approx(0.25, abs=1e-12)
    np.testing.assert_allclose(found.point, [0.5, 0.3, 0.0], atol=2e-9)


def test_hard_rows_that_clash_are_no_case_3() -> None:
    hard = np.concatenate([CUBE, [[1.0, 0.0, 0.0, 0.75]]])
    found = answer(np.array([[0.0, 1.0, 0.0, 0.1]]), np.zeros(3), hard)
    assert found.status == CONTRADICTION
    assert found.least == np.inf


@given(seed=st.integers(0, 99_999), size=st.integers(2, 12), flat=st.booleans())
def test_t_is_that_of_the_exact_linear_program_and_the_point_the_nearest(
    seed: int, size: int, flat: bool
) -> None:
    rng = np.random.default_rng(seed)
    soft = unit_rows(rng, size, 0.2)
    if flat:
        # All in one plane: what holds a point there is no corner of space.
        soft[:, 2] = 0.0
        soft[:, :3] /= np.linalg.norm(soft[:, :3], axis=1)[:, None]
    wanted = rng.normal(size=3)
    found = answer(soft, wanted)
    rows = half_spaces(CUBE, soft)
    exact = Exact(1e-15).solve(least_violation_program(rows, 0))
    assert found.status == SOLVED
    assert found.is_nearest
    assert found.least == pytest.approx(float(exact.x[3]), abs=1e-9)
    if found.least > TOLERANCE:
        assert found.is_proved
        nearest = Exact(1e-15).solve(nearest_velocity(rows, 0, wanted, found.relaxation))
        np.testing.assert_allclose(found.point, nearest.x, atol=1e-7)


@given(seed=st.integers(0, 9999), spread=st.sampled_from((1e-3, 1e-6, 1e-9, 1e-12)))
def test_rows_all_but_parallel_never_get_a_proof_that_is_none(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    normals = rng.choice([-1.0, 1.0], (6, 1)) * axis + spread * rng.normal(size=(6, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    soft = np.hstack([normals, rng.uniform(-0.1, 0.2, (6, 1))])
    found = answer(soft, rng.normal(size=3))
    assert found.status != STALLED
    exact = Exact(1e-15).solve(least_violation_program(half_spaces(CUBE, soft), 0))
    assert found.least == pytest.approx(float(exact.x[3]), abs=2e-9)
    assert found.is_nearest

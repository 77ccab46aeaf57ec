"""Projection in space: by hand, against exact rational arithmetic, and on rows that active-set methods stumble over."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.exact_backend import Exact
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows
from safefilter.backends.planar_kernel import project as project_in_plane
from safefilter.backends.space_kernel import make_held, make_room, project
from safefilter.backends.space_kernel_checks import is_nearest
from safefilter.jit import kernel
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.strategies import angles

TOLERANCE = 1e-9
# The cube of half-width 1/2.
CUBE = [(*e, -0.5) for e in np.concatenate([np.eye(3), -np.eye(3)]).tolist()]
Row = tuple[float, ...]


class Answer(NamedTuple):
    status: int
    point: FloatArray
    rows: list[int]
    weights: FloatArray


@kernel
def solve(
    array: FloatArray, num_hard: int, wanted: FloatArray
) -> tuple[int, FloatArray, IntArray, FloatArray, bool]:
    size = len(wanted)
    rows = Rows(array, array.shape[1], num_hard, 0, 0.0)
    held, room = make_held(size), make_room(size, array.shape[1])
    status, count = project(rows, 0.0, wanted, TOLERANCE, held, held.rows, 0, room)
    point = room.point.copy()
    near = status == SOLVED and is_nearest(rows, 0.0, wanted, point, TOLERANCE, held, count, room)
    return status, point, held.rows[:count], held.weights[:count], near


@kernel
def kept(array: FloatArray, wanted: FloatArray) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    size = len(wanted)
    rows = Rows(array, array.shape[1], array.shape[1], 0, 0.0)
    held, room = make_held(size), make_room(size, array.shape[1])
    _, count = project(rows, 0.0, wanted, TOLERANCE, held, held.rows, 0, room)
    return count, room.basis, room.wanted_parts, room.free


@kernel
def solve_in_plane(array: FloatArray, wanted: FloatArray) -> tuple[int, float, float]:
    rows = Rows(array, array.shape[1], array.shape[1], 0, 0.0)
    active, weights = np.zeros(3, dtype=np.int64), np.zeros(3)
    status, x, y, _ = project_in_plane(
        rows, 0.0, wanted[0], wanted[1], TOLERANCE, active, weights, active, 0
    )
    return status, x, y


def answer(rows: list[Row], wanted: FloatArray) -> Answer:
    status, point, held, weights, near = solve(np.array(rows).T.copy(), len(rows), wanted)
    assert near == (status == SOLVED)
    return Answer(status, point, held.tolist(), weights)


def assert_contradiction(rows: list[Row], found: Answer) -> None:
    """Weights of a contradiction: the normals cancel, and what the offsets ask for is above zero."""
    assert found.status == CONTRADICTION
    chosen = np.array(rows)[found.rows]
    assert (found.weights >= 0.0).all()
    scale = float(found.weights.sum())
    assert float(np.linalg.norm(found.weights @ chosen[:, :-1])) <= 1e-9 * scale
    assert float(found.weights @ chosen[:, -1]) > 0.0


def exact_projection(rows: list[Row], wanted: FloatArray) -> tuple[bool, FloatArray]:
    """Whether there is a point, and the nearest, in rational arithmetic."""
    array, size = np.array(rows), len(wanted)
    program = ConvexProgram(np.eye(size), -wanted, -array[:, :size], -array[:, size])
    solution = Exact(1e-15).solve(program)
    return solution.status.has_point, solution.x


def test_a_face_an_edge_and_a_corner_by_hand() -> None:
    face = answer(CUBE, np.array([2.0, 0.1, 0.2]))
    np.testing.assert_allclose(face.point, [0.5, 0.1, 0.2], rtol=1e-15)
    assert face.rows == [3]
    assert face.weights.tolist() == [1.5]
    edge = answer(CUBE, np.array([2.0, -3.0, 0.2]))
    np.testing.assert_allclose(edge.point, [0.5, -0.5, 0.2], rtol=1e-15)
    corner = answer(CUBE, np.array([2.0, -3.0, 4.0]))
    np.testing.assert_allclose(corner.point, [0.5, -0.5, 0.5], rtol=1e-15)
    assert sorted(zip(corner.rows, corner.weights.tolist(), strict=True)) == [
        (1, 2.5), (3, 1.5), (5, 3.5),
    ]  # fmt: skip


def test_what_is_permitted_stays_bit_for_bit() -> None:
    wanted = np.array([0.1, -0.2, 0.3])
    found = answer(CUBE, wanted)
    assert found.rows == []
    assert (found.point == wanted).all()


@pytest.mark.parametrize("num_rows", [2, 3, 4])
def test_contradictions_of_two_three_and_four_rows(num_rows: int) -> None:
    # Normals of a simplex in as many dimensions as it takes, each asked to be exceeded.
    directions = np.linalg.qr(np.ones((num_rows, 1)), mode="complete")[0][:, 1:]
    normals = np.zeros((num_rows, 3))
    normals[:, : num_rows - 1] = directions / np.linalg.norm(directions, axis=1)[:, None]
    rows: list[Row] = [*CUBE, *((*n, 0.01) for n in normals.tolist())]
    found = answer(rows, np.array([0.3, 0.2, 0.1]))
    assert_contradiction(rows, found)
    assert sorted(found.rows) == list(range(6, 6 + num_rows))


@given(seed=st.integers(0, 99_999), size=st.integers(1, 12), far=st.sampled_from((1.0, 100.0)))
def test_random_rows_against_exact_arithmetic(seed: int, size: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(size, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = rng.uniform(-0.5, 0.2, (size, 1))
    rows: list[Row] = [*CUBE, *map(tuple, np.hstack([normals, offsets]).tolist())]
    wanted = far * rng.normal(size=3)
    found = answer(rows, wanted)
    has_point, point = exact_projection(rows, wanted)
    if has_point:
        assert found.status == SOLVED
        np.testing.assert_allclose(found.point, point, atol=1e-9)
    else:
        assert_contradiction(rows, found)


@given(seed=st.integers(0, 99_999), far=st.sampled_from((1.0, 1e6, 1e12)))
def test_the_wanted_point_stays_taken_apart_whatever_rows_came_and_went(
    seed: int, far: float
) -> None:
    rng = np.random.default_rng(seed)
    size, num_rows = int(rng.integers(2, 7)), 16
    normals = rng.normal(size=(size, num_rows))
    normals /= np.linalg.norm(normals, axis=0)
    array = np.vstack([normals, rng.uniform(-1.0, -0.01, num_rows)])
    wanted = far * rng.normal(size=size)
    count, basis, parts, free = kept(array, wanted)
    basis, parts = basis[:count], parts[:count]
    np.testing.assert_allclose(basis @ basis.T, np.eye(count), atol=1e-12)
    np.testing.assert_allclose(parts @ basis + free, wanted, rtol=0.0, atol=1e-13 * far)
    np.testing.assert_allclose(basis @ free, 0.0, atol=1e-13 * far)


@st.composite
def awkward_rows(draw: st.DrawFn) -> list[Row]:
    """Rows that repeat, oppose, lie in one plane or within 1e-15 ... 1e-3 of another, many through one point."""
    rows: list[Row] = []
    for _ in range(draw(st.integers(1, 7))):
        is_copy = draw(st.booleans())
        if rows and is_copy:
            x, y, z, offset = rows[draw(st.integers(0, len(rows) - 1))]
            tilt = 10.0 ** -draw(st.integers(3, 15)) * draw(st.sampled_from((0.0, 1.0, -1.0)))
            sign = draw(st.sampled_from((1.0, -1.0)))
            normal = np.array([x, y, z]) * sign + tilt * np.array([y, z, x])
            shift = draw(st.sampled_from((0.0, 1e-12, -1e-6, -0.1)))
            offset = sign * offset + shift
        else:
            angle, rise = draw(angles()), draw(st.sampled_from((0.0, 0.0, 1.0, -1.0, 0.6)))
            flat = math.sqrt(1.0 - rise * rise)
            normal = np.array([flat * math.cos(angle), flat * math.sin(angle), rise])
            offset = draw(st.sampled_from((0.0, -0.1, -0.3, 0.1)))
        normal /= np.linalg.norm(normal)
        rows.append((*normal.tolist(), offset))
    return rows


@given(drawn=awkward_rows(), seed=st.integers(0, 999))
@example(drawn=[(1.0, 0.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.1)], seed=0)
@example(drawn=[(1.0, 0.0, 0.0, 0.1), (1.0, 0.0, 0.0, 0.1), (-1.0, 0.0, 0.0, -0.1)], seed=1)
def test_awkward_rows_come_with_a_proof_of_one_or_the_other(drawn: list[Row], seed: int) -> None:
    rows = [*CUBE, *drawn]
    wanted = np.random.default_rng(seed).normal(size=3)
    found = answer(rows, wanted)
    if found.status == SOLVED:
        assert max(offset - float(np.dot(n, found.point)) for *n, offset in rows) <= 1e-11
    else:
        assert_contradiction(rows, found)


@given(seed=st.integers(0, 99_999), size=st.integers(3, 10))
def test_with_two_dimensions_it_is_the_solver_of_the_plane(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, size)
    array = np.stack([np.cos(angle), np.sin(angle), rng.uniform(-0.5, 0.1, size)])
    wanted = rng.normal(size=2)
    status, point, *_ = solve(array, size, wanted)
    expected, x, y = solve_in_plane(array, wanted)
    assert status == expected
    if status == SOLVED:
        np.testing.assert_allclose(point, [x, y], atol=1e-9)


def test_a_wish_far_off_lands_on_its_corner_to_the_last_places() -> None:
    found = answer(CUBE, np.array([1e14, -3e14, 2e14]))
    np.testing.assert_allclose(found.point, [0.5, -0.5, 0.5], rtol=1e-15)

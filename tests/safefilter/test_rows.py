"""Rows of one decision, laid out in sections: sides, budgets, hard rows, soft rows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.rows import hold, soft_violation
from safefilter.constraints.row_buffers import Sections

# x >= 0.1, y >= 0, x <= 0.3 as columns (n_x, n_y, offset).
ROWS = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.1, 0.0, -0.3]])


def is_held(first: int, last: int, x: float, y: float, tolerance: float = 0.0) -> bool:
    return hold(ROWS, first, last, x, y, tolerance)


def test_rows_hold_on_their_boundary_and_to_the_tolerance_beyond() -> None:
    assert is_held(0, 3, 0.2, 0.1)
    assert is_held(0, 3, 0.1, 0.0)
    assert not is_held(0, 3, 0.1 - 1e-6, 0.0)
    assert is_held(0, 3, 0.1 - 1e-6, 0.0, 2e-6)


def test_only_rows_of_the_range_are_asked() -> None:
    assert is_held(1, 3, 0.0, 0.0)
    assert is_held(1, 2, 9.0, 0.0)
    assert is_held(2, 2, 9.0, -9.0)


@pytest.mark.parametrize("point", [(math.nan, 0.0), (0.2, math.nan)])
def test_nothing_holds_where_there_is_no_point(point: tuple[float, float]) -> None:
    assert not is_held(0, 3, *point)


def sections(num_hard: int, num_rows: int) -> Sections:
    return Sections(0, 0, 0, num_hard, num_rows)


def test_the_violation_is_that_of_the_worst_soft_row_and_never_below_zero() -> None:
    assert soft_violation(ROWS, sections(0, 3), 0.2, 0.1) == 0.0
    assert soft_violation(ROWS, sections(0, 3), 0.0, -0.3) == pytest.approx(0.3, abs=1e-16)
    assert soft_violation(ROWS, sections(2, 3), 0.5, -0.3) == pytest.approx(0.2, abs=1e-16)
    assert soft_violation(ROWS, sections(3, 3), 9.0, -9.0) == 0.0


class Mixed:
    """Rows of all kinds in an order of their own: soft, hard and broken at rest, hard, absent."""

    name = "mixed"

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        batch = len(index)
        assert len(action) == batch <= scene.num_robots
        return sf.HalfSpaces(
            normals=np.tile([[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]], (batch, 1, 1)),
            offsets=np.tile([[-0.1, 0.01, -0.15, 9.0]], (batch, 1)),
            hard=np.tile([[False, True, True, True]], (batch, 1)),
            present=np.tile([[True, True, True, False]], (batch, 1)),
            labels=np.stack(
                [np.zeros((batch, 4)), np.tile(np.arange(4.0), (batch, 1))], axis=2
            ).astype(np.int64),
            sources=(self.name,),
        )


@given(st.integers(3, 9), st.permutations([0, 1, 2]))
def test_rows_come_hard_before_soft_whatever_the_order_of_the_constraints(
    num_sides: int, order: list[int]
) -> None:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(0.2), Mixed()]
    scene = sf.Scene.from_world([[0.0, 0.0], [0.25, 0.0], [0.0, 0.25]], np.zeros((3, 2)), 0.1)
    filter_ = sf.SafetyFilter([constraints[k] for k in order], sf.Holonomic(0.2, num_sides))
    rows = filter_.half_spaces(scene, np.zeros((3, 2)))
    for k in range(3):
        present, num_near = rows.present[k], 2 if k == 0 else 1
        names = [filter_.sources[source] for source in rows.labels[k, present, 0]]
        assert names == (
            ["allowed_velocities"] * num_sides
            + ["separation"] * num_near
            + ["mixed"] * 2
            + ["priority_orca"] * 2
            + ["mixed"]
        )
        assert rows.hard[k][present].tolist() == [True] * (num_sides + num_near + 2) + [False] * 3
        # Of the user's hard rows those come first that standing still keeps.
        assert rows.labels[k, num_sides + num_near : num_sides + num_near + 2, 1].tolist() == [2, 1]
        # Absent rows take room, and are nothing else.
        assert not present[num_sides + num_near + 5 :].any()

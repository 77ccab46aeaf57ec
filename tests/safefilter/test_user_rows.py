"""Rows of a user's own constraints reach the kernels sorted: budgets, other hard rows, soft rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.rows import copy_rows
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.linear_constraint import LinearConstraint
from safefilter.constraints.row_buffers import RowLabels
from safefilter.constraints.user_rows import (
    ABSENT,
    BUDGET,
    HARD,
    LARGEST_LABEL,
    NUM_MARKS,
    SOFT,
    user_rows,
)
from safefilter.errors import OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene

SCENE = Scene.from_world(np.zeros((4, 2)), np.zeros((4, 2)), 0.1)


@dataclass(frozen=True)
class Given:
    """A constraint that makes rows given beforehand, as a user may write one."""

    rows: HalfSpaces
    name: str = "given"

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        return self.rows


def random_rows(num_decisions: int, num_rows: int, seed: int, dimension: int = 2) -> HalfSpaces:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(num_decisions, num_rows, dimension))
    shape = (num_decisions, num_rows)
    labels = np.zeros((*shape, 2), dtype=np.int64)
    labels[:, :, 1] = np.arange(num_rows)
    return HalfSpaces(
        normals=normals / np.linalg.norm(normals, axis=2, keepdims=True),
        offsets=rng.choice([-0.5, 0.0, 0.5], shape),
        hard=rng.random(shape) < 0.5,
        present=rng.random(shape) < 0.7,
        labels=labels,
        sources=("given",),
    )


def kind(rows: HalfSpaces, b: int, m: int) -> int:
    if not rows.present[b, m]:
        return ABSENT
    if not rows.hard[b, m]:
        return SOFT
    return BUDGET if rows.offsets[b, m] <= 0.0 else HARD


def listed(
    constraints: dict[int, Constraint], num_decisions: int
) -> list[dict[int, list[tuple[float, ...]]]]:
    """Rows of each decision by kind with their labels, as kernels copy them."""
    packed = user_rows(constraints, SCENE, np.zeros((num_decisions, 2)), np.arange(num_decisions))
    assert packed.shape[:2] == (num_decisions, 3 + NUM_MARKS)
    found: list[dict[int, list[tuple[float, ...]]]] = []
    for b in range(num_decisions):
        found.append({})
        for wanted in (BUDGET, HARD, SOFT):
            room = packed.shape[2]
            rows = RowLabels(np.zeros((3, room)), np.zeros((2, room), dtype=np.int64))
            count = copy_rows(packed, b, wanted, rows, 0)
            columns = np.concatenate([rows.array, rows.label])[:, :count]
            found[-1][wanted] = [tuple(column) for column in columns.T]
    return found


sizes = st.tuples(st.integers(0, 4), st.integers(0, 5), st.integers(0, 99))


@given(first=sizes, num_rows=st.integers(0, 3))
def test_every_present_row_comes_once_under_its_kind(
    first: tuple[int, int, int], num_rows: int
) -> None:
    num_decisions, seed = first[0], first[2]
    parts = {3: random_rows(*first), 5: random_rows(num_decisions, num_rows, seed + 1)}
    found = listed({number: Given(rows) for number, rows in parts.items()}, num_decisions)
    for b in range(num_decisions):
        for wanted in (BUDGET, HARD, SOFT):
            assert found[b][wanted] == [
                (*rows.normals[b, m], rows.offsets[b, m], number, m)
                for number, rows in parts.items()
                for m in range(rows.num_rows)
                if kind(rows, b, m) == wanted
            ]


def test_a_hard_row_that_permits_standing_still_is_a_budget() -> None:
    rows = LinearConstraint([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], [0.1, 0.0, -0.1])
    (found,) = listed({2: rows}, 1)
    assert [row[2] for row in found[BUDGET]] == [0.0, -0.1]
    assert [row[2] for row in found[HARD]] == [0.1]
    assert not found[SOFT]


def test_constraints_are_asked_for_the_robots_of_the_decisions() -> None:
    asked = []

    class Asked:
        name = "asked"

        def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:
            asked.append((scene, action.tolist(), index.tolist()))
            action[:] = 99.0  # whatever it does to its copy
            return HalfSpaces.everywhere(len(index), 2)

    wanted = np.array([[1.0, 2.0], [3.0, 4.0]])
    user_rows({1: Asked(), 2: Asked()}, SCENE, wanted, np.array([3, 1]))
    assert asked == [(SCENE, [[1.0, 2.0], [3.0, 4.0]], [3, 1])] * 2
    assert wanted.tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize(("num_decisions", "dimension"), [(1, 2), (2, 3), (0, 2)])
def test_rows_for_something_else_are_refused(num_decisions: int, dimension: int) -> None:
    wrong = Given(HalfSpaces.everywhere(num_decisions, dimension), name="corridor")
    with pytest.raises(ShapeError) as caught:
        user_rows({1: wrong}, SCENE, np.zeros((2, 2)), np.arange(2))
    assert str(caught.value) == (
        "corridor: expected rows for 2 decisions in 2 dimensions, "
        f"got {num_decisions} in {dimension}"
    )


@pytest.mark.parametrize("label", [LARGEST_LABEL, -LARGEST_LABEL])
def test_labels_are_told_exactly_or_refused(label: int) -> None:
    rows = random_rows(1, 1, 0)
    labels = np.array([[[0, label]]])
    exact = replace(rows, labels=labels, present=np.ones((1, 1), dtype=np.bool_))
    (found,) = listed({1: Given(exact)}, 1)
    assert [row[-1] for kind_rows in found.values() for row in kind_rows] == [label]
    beyond = replace(exact, labels=labels + np.sign(label) * np.array([0, 1]))
    with pytest.raises(
        OutOfRange, match=rf"given: labels: expected numbers up to 2\^53, got {label}"[:-1]
    ):
        user_rows({1: Given(beyond)}, SCENE, np.zeros((1, 2)), np.arange(1))

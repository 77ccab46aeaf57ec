from collections.abc import Callable
from typing import Any

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from safefilter.differentiable.answer import answer
from safefilter.differentiable.found import TensorRows
from safefilter.differentiable.sensitivity import Answered, Gradients, gradients, least_violation_of

Ask = Callable[..., Any]
TOLERANCE = 1e-9
HALF = 0.75**0.5


def answered(
    action: list[float],
    normals: list[list[float]],
    offsets: list[float],
    hard: list[bool] | None = None,
) -> Answered:
    """One decision."""
    rows = TensorRows(
        torch.tensor([normals], dtype=torch.float64),
        torch.tensor([offsets], dtype=torch.float64),
        torch.tensor([hard or [False] * len(offsets)]),
        torch.ones(1, len(offsets), dtype=torch.bool),
    )
    return answered_of(torch.tensor([action], dtype=torch.float64), rows)


def answered_of(action: Tensor, rows: TensorRows) -> Answered:
    found = answer(action, rows, TOLERANCE)
    return Answered(
        rows.normals,
        rows.offsets,
        rows.hard,
        found.point,
        found.active,
        found.multipliers,
        found.proof,
        found.weights,
    )


def jacobian(question: Answered) -> list[Gradients]:
    """Gradients of each coordinate of the point."""
    batch, size = question.point.shape
    none = torch.zeros(batch, dtype=torch.float64)
    seeds = torch.eye(size, dtype=torch.float64)
    return [gradients(question, seed.expand(batch, size), none) for seed in seeds]


def of_least(question: Answered) -> list[float]:
    """Gradient of t* with respect to the offsets of one decision."""
    one = torch.ones(1, dtype=torch.float64)
    _, _, offsets = gradients(question, torch.zeros_like(question.point), one)
    row: list[float] = offsets[0].tolist()
    return row


def test_case_1_passes_everything_on() -> None:
    [(east, normals, offsets), (north, _, _)] = jacobian(
        answered([0.1, 0.2], [[-1.0, 0.0]], [-0.5])
    )
    assert east.tolist() == [[1.0, 0.0]]
    assert north.tolist() == [[0.0, 1.0]]
    assert not normals.any()
    assert not offsets.any()


def test_one_row_stops_its_own_direction_and_hands_its_offset_on() -> None:
    # v = (0.5, 0.2): east is held at -offset, and turning the row by dn_y moves v_x by 0.2 dn_y and v_y by 0.5 dn_y.
    [(east, normal_east, offset_east), (north, normal_north, _)] = jacobian(
        answered([1.0, 0.2], [[-1.0, 0.0]], [-0.5])
    )
    assert east.tolist() == [[0.0, 0.0]]
    assert north.tolist() == [[0.0, 1.0]]
    assert offset_east.tolist() == [[-1.0]]
    assert normal_east[0, 0].tolist() == pytest.approx([0.5, 0.2])
    assert normal_north[0, 0].tolist() == pytest.approx([0.0, 0.5])


def test_a_corner_hangs_on_its_rows_alone() -> None:
    [(east, _, offset_east), (north, _, offset_north)] = jacobian(
        answered([1.0, 1.0], [[-1.0, 0.0], [0.0, -1.0]], [-0.5, -0.25])
    )
    assert east.tolist() == [[0.0, 0.0]]
    assert north.tolist() == [[0.0, 0.0]]
    assert offset_east.tolist() == [[-1.0, 0.0]]
    assert offset_north.tolist() == [[0.0, -1.0]]


def test_between_opposite_soft_rows_the_point_moves_with_both() -> None:
    # x >= 0.5 and x <= 0.1 are each missed by 0.2, at x = 0.3.
    question = answered([5.0, 1.0], [[1.0, 0.0], [-1.0, 0.0]], [0.5, -0.1])
    [(east, _, offset_east), (north, _, _)] = jacobian(question)
    assert east.tolist() == [[0.0, 0.0]]
    assert north.tolist() == [[0.0, 1.0]]
    assert offset_east[0].tolist() == pytest.approx([0.5, -0.5])
    assert of_least(question) == pytest.approx([0.5, 0.5])
    assert least_violation_of(question).tolist() == pytest.approx([0.2])


def test_beside_a_hard_row_the_soft_one_alone_gives_way() -> None:
    # x >= 0.5 is hard, x <= 0.1 is not: x = 0.5, and t* = 0.4 grows by all that the hard row moves.
    question = answered([5.0, 1.0], [[1.0, 0.0], [-1.0, 0.0]], [0.5, -0.1], [True, False])
    [(_, _, offset_east), (north, _, _)] = jacobian(question)
    assert offset_east[0].tolist() == pytest.approx([1.0, 0.0])
    assert north.tolist() == [[0.0, 1.0]]
    assert of_least(question) == pytest.approx([1.0, 1.0])


def test_around_a_triangle_t_is_the_mean_of_the_offsets() -> None:
    question = answered([3.0, 1.0], [[0.0, 1.0], [HALF, -0.5], [-HALF, -0.5]], [0.3, 0.2, 0.4])
    assert of_least(question) == pytest.approx([1 / 3] * 3)
    [(east, _, offset_east), _] = jacobian(question)
    # Moving all three rows alike moves t* alone.
    assert offset_east.sum().item() == pytest.approx(0.0, abs=1e-12)
    assert east[0].tolist() == pytest.approx([0.0, 0.0], abs=1e-15)


@given(seed=st.integers(0, 10**6), size=st.sampled_from([2, 3, 5]))
def test_stretching_a_row_changes_nothing(ask: Ask, seed: int, size: int) -> None:
    # The answer depends on offset / |normal| and normal / |normal|: its derivative along (normal, offset) is zero.
    question = ask(seed, 10, size, 8)
    rows = question.rows._replace(normals=3.0 * question.normals, offsets=3.0 * question.offsets)
    given_rows = answered_of(question.action, rows)
    for _, normals, offsets in jacobian(given_rows):
        along = (normals * rows.normals).sum(2) + offsets * rows.offsets
        scale = 1.0 + normals.abs().amax((1, 2)) + offsets.abs().amax(1)
        assert (along.abs().amax(1) <= 1e-12 * scale * (1.0 + given_rows.point.abs().amax(1))).all()


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), size=st.sampled_from([2, 3]))
def test_moving_everything_moves_the_answer_along(ask: Ask, seed: int, size: int) -> None:
    # v(a + d, offsets + normals . d) = v + d: so the derivative along that direction is d.
    question = ask(seed, 10, size, 6)
    given_rows = answered_of(question.action, question.rows)
    shift = torch.ones(size, dtype=torch.float64)
    moved = question.normals @ shift
    for coordinate, (action, _, offsets) in enumerate(jacobian(given_rows)):
        total = action @ shift + (offsets * moved).sum(1)
        scale = 1.0 + offsets.abs().amax(1)
        assert ((total - shift[coordinate]).abs() <= 1e-9 * scale).all()


def test_of_rows_that_are_the_same_one_has_all_the_weight() -> None:
    [(_, _, offsets), _] = jacobian(answered([1.0, 0.0], [[-1.0, 0.0]] * 2, [-0.5] * 2))
    assert sorted(offsets[0].tolist()) == [-1.0, 0.0]


def test_on_the_border_of_a_row_it_is_the_inside_that_counts() -> None:
    [(east, _, _), _] = jacobian(answered([0.5, 0.0], [[-1.0, 0.0]], [-0.5]))
    assert east.tolist() == [[1.0, 0.0]]

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from safefilter.decision import Case
from safefilter.differentiable import answer as answer_module
from safefilter.differentiable import dense_steps
from safefilter.differentiable.answer import answer, half_spaces_of, repair, unit_rows
from safefilter.differentiable.dense_search import dense_search
from safefilter.differentiable.found import TensorRows
from safefilter.errors import EmptyHardSet, NotFinite, OutOfRange

Ask = Callable[..., Any]
TOLERANCE = 1e-9


def rows_of(normals: list[list[float]], offsets: list[float], hard: bool = False) -> TensorRows:
    """One decision."""
    return TensorRows(
        torch.tensor([normals], dtype=torch.float64),
        torch.tensor([offsets], dtype=torch.float64),
        torch.full((1, len(offsets)), hard),
        torch.ones(1, len(offsets), dtype=torch.bool),
    )


def point(*values: float) -> Tensor:
    return torch.tensor([values], dtype=torch.float64)


def test_rows_of_length_one_are_left_alone_to_the_bit(ask: Ask) -> None:
    rows = ask(0).rows
    assert unit_rows(rows).normals.equal(rows.normals)
    mixed = rows._replace(normals=torch.cat([2.0 * rows.normals[:1], rows.normals[1:]]))
    assert unit_rows(mixed).normals[1:].equal(rows.normals[1:])


def test_offsets_become_distances() -> None:
    rows = unit_rows(rows_of([[3.0, 4.0]], [2.0]))
    assert rows.normals.tolist() == [[[0.6, 0.8]]]
    assert rows.offsets.tolist() == [[0.4]]


def test_what_is_absent_may_be_anything() -> None:
    rows = rows_of([[-1.0, 0.0], [0.0, 0.0], [float("nan"), 1.0]], [-0.5, 1.0, float("inf")])
    rows.present[0, 1:] = False
    found = answer(point(1.0, 2.0), rows, TOLERANCE)
    assert found.point.tolist() == [[0.5, 2.0]]
    in_space = rows._replace(normals=torch.cat([rows.normals, torch.zeros(1, 3, 1)], dim=2))
    assert answer(point(1.0, 2.0, 3.0), in_space, TOLERANCE).point.tolist() == [[0.5, 2.0, 3.0]]


def test_what_cannot_be_used_is_named() -> None:
    with pytest.raises(OutOfRange, match="decision 0, row 1: expected a direction, got zeros"):
        answer(point(0.0, 0.0), rows_of([[1.0, 0.0], [0.0, 0.0]], [0.1, 0.1]), TOLERANCE)
    with pytest.raises(NotFinite, match="row 0 of decision 0"):
        answer(point(0.0, 0.0), rows_of([[1.0, 0.0]], [float("nan")]), TOLERANCE)
    with pytest.raises(NotFinite, match="row 0 of decision 0"):
        answer(point(0.0, 0.0), rows_of([[1e200, 0.0]], [0.1]), TOLERANCE)
    with pytest.raises(NotFinite, match="action of decision 0"):
        answer(point(float("inf"), 0.0), rows_of([[1.0, 0.0]], [0.1]), TOLERANCE)


@pytest.mark.parametrize("size", [2, 3])
def test_hard_rows_that_clash_are_an_error_with_their_names(size: int) -> None:
    rows = torch.eye(size, dtype=torch.float64)
    normals = torch.stack([rows[1], rows[0], -rows[0]])
    with pytest.raises(EmptyHardSet, match=r"decision 0: .* rows \[1, 2\] contradict"):
        answer(point(*[0.0] * size), rows_of(normals.tolist(), [0.0, 0.2, 0.2], True), TOLERANCE)


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("length", [1.0, 3.0])
def test_what_a_compiled_search_cannot_prove_is_answered_exactly(size: int, length: float) -> None:
    # These meet at 1e5; in floats that is too far to be proved to 1 nm.
    sliver = 2e-6
    normals = np.zeros((3, size))
    normals[:, :2] = [[length, 0.0], [-length, length * sliver], [-length, -length * sliver]]
    rows = rows_of(normals.tolist(), [0.2 * length] * 3)
    found = answer(point(*[0.0] * size), rows, TOLERANCE)
    assert found.is_proved.all()
    assert found.case.tolist() == [Case.LEAST_VIOLATION]


@pytest.mark.parametrize("size", [1, 2, 3, 6])
def test_on_the_cpu_it_answers_as_it_does_elsewhere(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    question = ask(size, 200, size, 10)
    stretched = question.rows._replace(normals=2.5 * question.normals)
    stretched.offsets[~stretched.present] = float("nan")
    compiled = answer(question.action, stretched, TOLERANCE)
    monkeypatch.setattr(answer_module, "_compiled", answer_module._in_torch)
    dense = answer(question.action, stretched, TOLERANCE)
    assert set(compiled.case.tolist()) == set(Case)
    assert compiled.case.equal(dense.case)
    torch.testing.assert_close(compiled.point, dense.point, atol=1e-8, rtol=0.0)


@pytest.mark.parametrize("size", [3, 5])
def test_what_the_dense_search_gives_up_is_answered_exactly(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    question = ask(4, 30, size, 10)
    expected = answer(question.action, question.rows, TOLERANCE)
    assert set(expected.case.tolist()) == set(Case)
    monkeypatch.setattr(dense_steps, "LEAST_STEPS", 1)
    monkeypatch.setattr(dense_steps, "STEPS_PER_ROW", 0)
    repaired = dense_search(question.action, question.rows, TOLERANCE)
    assert not repaired.is_proved.all()
    repair(repaired, question.action, question.rows, TOLERANCE)
    assert repaired.is_proved.all()
    assert repaired.case.equal(expected.case)
    torch.testing.assert_close(repaired.point, expected.point, atol=1e-8, rtol=0.0)
    assert (repaired.active >= 0).sum() == (expected.active >= 0).sum()
    torch.testing.assert_close(
        repaired.weights.sort(1).values, expected.weights.sort(1).values, atol=1e-6, rtol=0.0
    )


def test_one_decision_is_viewed_as_the_filters_own_rows(ask: Ask) -> None:
    question = ask(0)
    system = half_spaces_of(question.rows, 3)
    assert system.normals[0].tolist() == question.normals[3].tolist()
    assert system.hard[0].tolist() == question.hard[3].tolist()
    assert system.describe(0, 2) == "row 2"

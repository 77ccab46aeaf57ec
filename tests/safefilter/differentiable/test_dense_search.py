from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from safefilter.decision import Case
from safefilter.differentiable.answer import answer, half_spaces_of
from safefilter.differentiable.dense_search import dense_search
from safefilter.differentiable.exact_answer import exact_answer
from safefilter.differentiable.found import Found, TensorRows

Ask = Callable[..., Any]
TOLERANCE = 1e-9


def found(
    action: list[float], normals: list[list[float]], offsets: list[float], hard: list[bool]
) -> Found:
    """One decision."""
    rows = TensorRows(
        torch.tensor([normals], dtype=torch.float64),
        torch.tensor([offsets], dtype=torch.float64),
        torch.tensor([hard]),
        torch.ones(1, len(hard), dtype=torch.bool),
    )
    return dense_search(torch.tensor([action], dtype=torch.float64), rows, TOLERANCE)


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), num_rows=st.integers(1, 30))
@example(seed=0, num_rows=30)
def test_in_the_plane_it_answers_as_the_filter_does(ask: Ask, seed: int, num_rows: int) -> None:
    question = ask(seed, 40, 2, num_rows)
    compiled = answer(question.action, question.rows, TOLERANCE)
    dense = dense_search(question.action, question.rows, TOLERANCE)
    assert dense.is_proved.all()
    assert dense.case.equal(compiled.case)
    torch.testing.assert_close(dense.point, compiled.point, atol=1e-8, rtol=0.0)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_elsewhere_it_answers_as_exact_arithmetic_does(ask: Ask, seed: int) -> None:
    question = ask(seed, 4, 4, 9)
    dense = dense_search(question.action, question.rows, TOLERANCE)
    for k in range(4):
        system = half_spaces_of(question.rows, k)
        exact = exact_answer(system, question.action[k].numpy(), TOLERANCE)
        scale = 1.0 + float(dense.point[k].norm())
        assert dense.point[k].tolist() == pytest.approx(list(exact.point), abs=1e-8 * scale)
        if dense.case[k] != Case.SAFE:
            assert dense.case[k] == exact.case


def test_three_rows_around_a_triangle_meet_in_its_middle() -> None:
    half = float(np.sqrt(0.75))
    rows = [[0.0, 1.0], [half, -0.5], [-half, -0.5]]
    out = found([3.0, 1.0], rows, [0.3, 0.3, 0.3], [False] * 3)
    assert out.case.tolist() == [Case.LEAST_VIOLATION]
    assert out.point[0].tolist() == pytest.approx([0.0, 0.0], abs=4e-9)
    assert out.weights[0].tolist() == pytest.approx([1 / 3] * 3)
    assert sorted(out.proof[0].tolist()) == [0, 1, 2]


def test_rows_that_are_the_same_count_once() -> None:
    out = found([1.0, 0.0, 0.0], [[-1.0, 0.0, 0.0]] * 3, [-0.5] * 3, [False] * 3)
    assert out.point.tolist() == [[0.5, 0.0, 0.0]]
    assert (out.active >= 0).sum() == 1
    assert out.is_proved.all()


def test_without_rows_everything_is_permitted() -> None:
    out = dense_search(
        torch.ones(2, 3, dtype=torch.float64),
        TensorRows(
            torch.empty(2, 0, 3, dtype=torch.float64),
            torch.empty(2, 0, dtype=torch.float64),
            torch.empty(2, 0, dtype=torch.bool),
            torch.empty(2, 0, dtype=torch.bool),
        ),
        TOLERANCE,
    )
    assert out.point.tolist() == [[1.0] * 3] * 2
    assert out.case.tolist() == [Case.SAFE] * 2


def test_a_point_far_off_is_proved_all_the_same(ask: Ask) -> None:
    question = ask(3, 40, 6, 20)
    dense = dense_search(1e4 * question.action, question.rows, TOLERANCE)
    assert dense.is_proved.all()


def test_no_tensor_is_made_where_nobody_named_a_device(ask: Ask) -> None:
    question = ask(0, 40, 3, 10)
    assert set(dense_search(question.action, question.rows, TOLERANCE).case.tolist()) >= {2, 3}
    with torch.device("meta"):
        out = dense_search(question.action, question.rows, TOLERANCE)
    assert {field.device.type for field in out} == {"cpu"}


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_on_cuda_it_answers_as_on_the_cpu(ask: Ask) -> None:
    question = ask(2, 200, 2, 10)
    here = dense_search(question.action, question.rows, TOLERANCE)
    rows = TensorRows(*(field.cuda() for field in question.rows))
    there = dense_search(question.action.cuda(), rows, TOLERANCE)
    assert there.case.cpu().equal(here.case)
    torch.testing.assert_close(there.point.cpu(), here.point, atol=1e-8, rtol=0.0)

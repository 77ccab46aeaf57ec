from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from safefilter.backends.clarabel_backend import Clarabel
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED
from safefilter.differentiable.dense_least_violation import Relaxed, least_violation
from safefilter.differentiable.dense_steps import project
from safefilter.differentiable.found import TensorRows
from safefilter.half_spaces import HalfSpaces
from safefilter.polish import polish
from safefilter.programs import least_violation as epigraph

Ask = Callable[..., Any]
TOLERANCE = 1e-9


def relaxed(question: Any) -> tuple[Relaxed, Any]:
    """Case-3 decisions of a question, solved."""
    slack = torch.full_like(question.action[:, 0], 1e-12)
    rows = TensorRows(*question.rows)
    rows = rows._replace(offsets=torch.where(rows.present, rows.offsets, -torch.inf))
    first = project(rows.normals, rows.offsets, question.action, slack)
    index = torch.nonzero(first.status == CONTRADICTION)[:, 0]
    answer = Relaxed.by_nothing(first).part(index)
    least_violation(answer, question.action[index], rows.part(index), TOLERANCE)
    return answer, question.part(index)


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), sizes=st.sampled_from([(1, 4), (2, 8), (3, 12), (5, 20)]))
def test_the_least_violation_is_that_of_the_linear_program(
    ask: Ask, seed: int, sizes: tuple[int, int]
) -> None:
    answer, question = relaxed(ask(seed, 12, *sizes))
    assert (answer.projected.status == SOLVED).all()
    for k in range(len(question.action)):
        labels = np.zeros((1, sizes[1], 2), dtype=np.int64)
        normals, offsets, hard, present = (field[k][None].numpy() for field in question.rows)
        system = HalfSpaces(normals, offsets, hard, present, labels, ("row",))
        program = epigraph.least_violation(system, 0)
        solution = Clarabel(1e-9).solve(program)
        exact = polish(program, solution, tolerance=TOLERANCE)
        assert answer.least[k].item() == pytest.approx(exact.x[-1], abs=1e-8)


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6))
def test_weights_prove_it(ask: Ask, seed: int) -> None:
    answer, question = relaxed(ask(seed, 20, 3, 12))
    place, used = answer.proof.clamp(min=0), answer.proof >= 0
    weights = torch.where(used, answer.weights, 0.0)
    assert (weights >= 0.0).all()
    soft = torch.where(question.hard.gather(1, place), 0.0, weights).sum(1)
    torch.testing.assert_close(soft, torch.ones_like(soft))
    bound = (weights * question.offsets.gather(1, place)).sum(1)
    torch.testing.assert_close(bound, answer.least, atol=1e-10, rtol=0.0)


def test_hard_rows_that_clash_are_left_as_a_contradiction(ask: Ask) -> None:
    question = ask(0, 1, 2, 3)
    normals = torch.tensor([[[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]], dtype=torch.float64)
    question.normals.copy_(normals)
    question.offsets.copy_(torch.tensor([[0.5, 0.5, 0.0]]))
    question.hard.fill_(True)
    question.present.fill_(True)
    answer, _ = relaxed(question)
    assert answer.projected.status.tolist() == [CONTRADICTION]
    assert answer.least.tolist() == [0.0]

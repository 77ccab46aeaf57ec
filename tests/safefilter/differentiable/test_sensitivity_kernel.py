from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st
from torch import Tensor

from safefilter.decision import Case
from safefilter.differentiable.answer import answer
from safefilter.differentiable.dense_search import dense_search
from safefilter.differentiable.found import Found
from safefilter.differentiable.sensitivity import Answered, Gradients, gradients
from safefilter.differentiable.sensitivity_kernel import AnsweredArrays, compiled_gradients

Ask = Callable[..., Any]
TOLERANCE = 1e-9


def answered(question: Any, found: Found) -> Answered:
    return Answered(
        question.normals,
        question.offsets,
        question.hard,
        found.point,
        found.active,
        found.multipliers,
        found.proof,
        found.weights,
    )


def compiled(given_rows: Answered, of_point: Tensor, of_least: Tensor) -> Gradients:
    arrays = AnsweredArrays(*(field.contiguous().numpy() for field in given_rows))
    own = compiled_gradients(arrays, of_point.numpy(), of_least.numpy())
    return Gradients(*map(torch.from_numpy, own))


def seeds(question: Answered, seed: int = 0) -> tuple[Tensor, Tensor]:
    rng = np.random.default_rng(seed)
    batch, size = question.point.shape
    return torch.from_numpy(rng.normal(size=(batch, size))), torch.from_numpy(
        rng.normal(size=batch)
    )


def assert_same(question: Answered, seed: int = 0) -> Gradients:
    """The compiled gradients are those of torch, relative to the largest of a decision."""
    of_point, of_least = seeds(question, seed)
    own, other = compiled(question, of_point, of_least), gradients(question, of_point, of_least)
    # Rows all but parallel have long inverses, in which rounding shows.
    scale = 1.0 + other.offsets.abs().sum(1) * (1.0 + question.multipliers.sum(1)) * (
        1.0 + question.point.abs().sum(1)
    )
    for one, two in zip(own, other, strict=True):
        off = (one - two).flatten(1).abs().amax(1) if one[0].numel() else torch.zeros(len(one))
        assert (off <= 1e-12 * scale).all()
    return own


@settings(max_examples=60)
@given(
    seed=st.integers(0, 10**6),
    size=st.integers(1, 12),
    num_rows=st.integers(0, 20),
    stretch=st.sampled_from([1.0, 0.01, 3.0]),
)
@example(seed=1, size=2, num_rows=8, stretch=1.0)
@example(seed=1, size=3, num_rows=12, stretch=3.0)
def test_gradients_are_those_of_torch(
    ask: Ask, seed: int, size: int, num_rows: int, stretch: float
) -> None:
    question = ask(seed, 20, size, num_rows)
    question.normals.mul_(stretch)
    question.offsets.mul_(stretch)
    assert_same(answered(question, answer(question.action, question.rows, TOLERANCE)), seed)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_all_cases_are_among_them(ask: Ask, size: int) -> None:
    question = ask(size, 200, size, 5 + 2 * size)
    found = answer(question.action, question.rows, TOLERANCE)
    assert set(found.case.tolist()) == set(Case)
    own = assert_same(answered(question, found))
    safe = found.case == int(Case.SAFE)
    assert not own.offsets[safe].any()
    assert not own.normals[safe].any()
    assert own.action[safe].equal(seeds(answered(question, found))[0][safe])


def test_slots_may_be_empty_in_between(ask: Ask) -> None:
    # The dense search may leave them where a row was dropped; an order the other way round stands for all.
    question = ask(5, 300, 4, 14)
    found = dense_search(question.action, question.rows, TOLERANCE)
    own = answered(question, found)
    names = ("active", "multipliers", "proof", "weights")
    turned = own._replace(**{name: getattr(own, name).flip(1) for name in names})
    is_gap = (turned.active[:, 0] < 0) & (turned.active[:, -1] >= 0)
    assert is_gap.any()
    assert_same(turned)
    of_point, of_least = seeds(own)
    for one, other in zip(
        compiled(own, of_point, of_least), compiled(turned, of_point, of_least), strict=True
    ):
        torch.testing.assert_close(one, other, atol=1e-9, rtol=1e-9)


def test_a_row_that_depends_on_the_others_has_no_pull() -> None:
    rows = torch.tensor([[[-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]]).double()
    question = Answered(
        normals=rows,
        offsets=torch.tensor([[-0.5, -0.5, -0.25]]).double(),
        hard=torch.zeros(1, 3, dtype=torch.bool),
        point=torch.tensor([[0.5, 0.25, 2.0]]).double(),
        active=torch.tensor([[0, 1, 2]]),
        multipliers=torch.tensor([[0.25, 0.25, 0.75]]).double(),
        proof=torch.full((1, 4), -1),
        weights=torch.zeros(1, 4).double(),
    )
    of_point = torch.tensor([[1.0, 2.0, 3.0]]).double()
    own = compiled(question, of_point, torch.zeros(1).double())
    assert own.action.tolist() == [[0.0, 0.0, 3.0]]
    assert own.offsets.tolist() == [[-1.0, 0.0, -2.0]]
    assert_same(question)


def test_a_corner_lets_nothing_through_at_all(ask: Ask) -> None:
    question = ask(0, 200, 3, 12)
    found = answer(question.action, question.rows, TOLERANCE)
    corner = (found.active >= 0).all(1)
    assert corner.sum() > 10
    own = compiled(answered(question, found), *seeds(answered(question, found)))
    assert not own.action[corner].any()


def test_a_large_batch_is_that_of_its_parts(ask: Ask) -> None:
    question = ask(0, 3000, 2, 10)
    whole = answered(question, answer(question.action, question.rows, TOLERANCE))
    of_point, of_least = seeds(whole)
    last = compiled(whole.part(torch.arange(2000, 3000)), of_point[2000:], of_least[2000:])
    for one, two in zip(compiled(whole, of_point, of_least), last, strict=True):
        assert one[2000:].equal(two)

from collections.abc import Callable
from typing import Any

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from safefilter.backends.backend import Status
from safefilter.backends.exact_backend import Exact
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, STALLED
from safefilter.differentiable import dense_steps
from safefilter.differentiable.dense_steps import Projected, project
from safefilter.programs.convex_program import ConvexProgram

Ask = Callable[..., Any]
SIZES = st.sampled_from([(1, 3), (2, 6), (3, 8), (6, 12)])


def projected(action: list[float], normals: list[list[float]], offsets: list[float]) -> Projected:
    """One decision, to the last bits."""
    return project(
        torch.tensor([normals], dtype=torch.float64),
        torch.tensor([offsets], dtype=torch.float64),
        torch.tensor([action], dtype=torch.float64),
        torch.zeros(1, dtype=torch.float64),
    )


def program_of(action: Tensor, normals: Tensor, offsets: Tensor) -> ConvexProgram:
    identity = torch.eye(len(action), dtype=torch.float64).numpy()
    return ConvexProgram(P=identity, q=-action.numpy(), G=-normals.numpy(), h=-offsets.numpy())


def test_a_corner_by_hand() -> None:
    out = projected([1.0, 1.0], [[-1.0, 0.0], [0.0, -1.0]], [-0.25, -0.5])
    assert out.status.tolist() == [SOLVED]
    assert out.point.tolist() == [[0.25, 0.5]]
    assert sorted(out.active[0].tolist()) == [-1, 0, 1]
    assert sorted(out.multipliers[0].tolist()) == [0.0, 0.5, 0.75]


def test_a_row_that_was_taken_in_too_early_is_let_go() -> None:
    # In order of violation, y >= 0.9 goes in before the last row, which makes it hold by itself.
    out = projected([0.0, 0.0], [[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8]], [1.0, 0.9, 0.85])
    assert out.status.tolist() == [SOLVED]
    assert sorted(out.active[0].tolist()) == [-1, 0, 2]
    assert out.point[0].tolist() == pytest.approx([1.0, 1.8125])
    assert sorted(out.multipliers[0].tolist()) == pytest.approx([0.0, 2.265625, 2.359375])


def test_opposite_rows_contradict_each_other() -> None:
    out = projected([0.0, 0.0], [[1.0, 0.0], [-1.0, 0.0]], [0.5, 0.25])
    assert out.status.tolist() == [CONTRADICTION]
    assert sorted(out.active[0].tolist()) == [-1, 0, 1]
    assert sorted(out.multipliers[0].tolist()) == [0.0, 1.0, 1.0]


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), sizes=SIZES)
def test_each_answer_is_that_of_exact_arithmetic_or_a_proof_that_there_is_none(
    ask: Ask, seed: int, sizes: tuple[int, int]
) -> None:
    question = ask(seed, 10, *sizes)
    offsets = torch.where(question.present, question.offsets, -torch.inf)
    out = project(
        question.normals, offsets, question.action, torch.full((10,), 1e-12, dtype=torch.float64)
    )
    for k in range(10):
        kept = question.present[k]
        program = program_of(question.action[k], question.normals[k, kept], offsets[k, kept])
        exact = Exact(1e-9).solve(program)
        if out.status[k] == SOLVED:
            assert exact.status is Status.OPTIMAL
            assert out.point[k].tolist() == pytest.approx(exact.x.tolist(), abs=1e-8)
        else:
            assert out.status[k] == CONTRADICTION
            assert exact.status is Status.INFEASIBLE
            _assert_contradiction(out, question, k)


def _assert_contradiction(out: Projected, question: Any, k: int) -> None:
    used = out.active[k] >= 0
    rows, weights = out.active[k, used], out.multipliers[k, used]
    assert (weights >= 0.0).all()
    assert (weights @ question.normals[k, rows]).abs().max() < 1e-10 * weights.sum()
    assert weights @ question.offsets[k, rows] > 0.0


def test_too_few_steps_are_said_to_be_too_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dense_steps, "LEAST_STEPS", 0)
    monkeypatch.setattr(dense_steps, "STEPS_PER_ROW", 0)
    out = projected([1.0, 1.0], [[-1.0, 0.0], [0.0, -1.0]], [-0.25, -0.5])
    assert out.status.tolist() == [STALLED]


def test_no_tensor_is_made_where_nobody_named_a_device(ask: Ask) -> None:
    question = ask(1)
    with torch.device("meta"):
        out = project(
            question.normals,
            question.offsets,
            question.action,
            torch.zeros_like(question.action[:, 0]),
        )
    assert out.point.device.type == "cpu"

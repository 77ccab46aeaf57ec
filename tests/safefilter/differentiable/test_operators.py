from collections.abc import Callable
from typing import Any

import pytest
import torch

from safefilter.differentiable.operators import project, project_now

Ask = Callable[..., Any]
# torch.library's own checks, but for those that need the operator to be traced with symbolic sizes of a backward graph.
CHECKS = (
    "test_schema",
    "test_autograd_registration",
    "test_faketensor",
    "test_aot_dispatch_dynamic",
)


@pytest.mark.parametrize("size", [2, 3])
def test_torch_finds_nothing_wrong_with_the_operator(ask: Ask, size: int) -> None:
    question = ask(0, 5, size, 6).with_gradients()
    rows = (question.normals, question.offsets, question.hard, question.present)
    torch.library.opcheck(project, (question.action, *rows, 1e-9), test_utils=CHECKS)


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("asked", [(0,), (1,), (0, 1)])
def test_without_the_dispatcher_everything_is_the_same_to_the_bit(
    ask: Ask, size: int, asked: tuple[int, ...]
) -> None:
    question = ask(0, 20, size, 6).with_gradients()
    leaves = (question.action, question.normals, question.offsets)
    expected, found = (
        call(*leaves, question.hard, question.present, 1e-9) for call in (project, project_now)
    )
    for ours, theirs in zip(found, expected, strict=True):
        assert ours.equal(theirs)
    slopes, expected_slopes = (
        torch.autograd.grad(
            torch.stack([answer[part].square().sum() for part in asked]).sum(), leaves
        )
        for answer in (found, expected)
    )
    assert any(slope.any() for slope in slopes)
    for ours, theirs in zip(slopes, expected_slopes, strict=True):
        assert ours.equal(theirs)


def test_shapes_are_known_without_an_answer() -> None:
    with torch.device("meta"):
        rows = (torch.empty(7, 4, 3), torch.empty(7, 4), *torch.empty(2, 7, 4).bool())
        out = project(torch.empty(7, 3), *rows, 1e-9)
    assert [tuple(field.shape) for field in out] == [
        (7, 3),
        (7,),
        (7,),
        (7, 3),
        (7, 3),
        (7, 4),
        (7, 4),
    ]

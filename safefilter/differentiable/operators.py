"""The two operators behind `Projection`, registered with torch: the answer, and its derivative.

As custom operators they are one step to `torch.compile` (which cannot look into a compiled kernel, and need not), and
say on which shapes they work. While nothing is compiled `project_now` calls the same code without the way through
torch's dispatcher, which takes longer than a small batch. They have a first derivative only: asking for a second one is
an error of torch's.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from safefilter.differentiable.answer import answer
from safefilter.differentiable.found import TensorRows
from safefilter.differentiable.sensitivity import (
    Answered,
    Gradients,
    gradients,
    least_violation_of,
)
from safefilter.differentiable.sensitivity_kernel import AnsweredArrays, compiled_gradients

Operator = Callable[..., tuple[Tensor, ...]]


def _project(
    action: Tensor,
    normals: Tensor,
    offsets: Tensor,
    hard: Tensor,
    present: Tensor,
    tolerance: float,
) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
    """Answer a batch, see `Projection.solve`.

    Args:
        action: Shape (B, n), float64.
        normals: Shape (B, M, n), float64.
        offsets: Shape (B, M), float64.
        hard: Shape (B, M), bool.
        present: Shape (B, M), bool.
        tolerance: In the unit of the action.

    Returns:
        Point, t*, case, active, multipliers, proof, weights.
    """
    found = answer(action, TensorRows(normals, offsets, hard, present), tolerance)
    answered = (found.point, found.active, found.multipliers, found.proof, found.weights)
    return (
        found.point,
        least_violation_of(Answered(normals, offsets, hard, *answered)),
        found.case,
        found.active,
        found.multipliers,
        found.proof,
        found.weights,
    )


project = torch.library.custom_op(
    "safefilter::project",
    _project,
    mutates_args=(),
    schema="(Tensor action, Tensor normals, Tensor offsets, Tensor hard, Tensor present, float tolerance)"
    " -> (Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor)",
)


@project.register_fake
def _shapes(action: Tensor, *_: Tensor | float) -> tuple[Tensor, ...]:
    batch, size = action.shape
    return (
        torch.empty_like(action),
        action.new_empty(batch),
        action.new_empty(batch, dtype=torch.int8),
        action.new_empty((batch, size), dtype=torch.int64),
        action.new_empty((batch, size)),
        action.new_empty((batch, size + 1), dtype=torch.int64),
        action.new_empty((batch, size + 1)),
    )


def _project_backward(
    of_point: Tensor, of_least: Tensor, *given: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients of an answer, see `safefilter.differentiable.sensitivity`; compiled on the CPU."""
    if of_point.device.type != "cpu":
        return gradients(Answered(*given), of_point, of_least)
    of_point_array, of_least_array, *arrays = (
        field.contiguous().numpy() for field in (of_point, of_least, *given)
    )
    compiled = compiled_gradients(AnsweredArrays(*arrays), of_point_array, of_least_array)
    return Gradients(*map(torch.from_numpy, compiled))


project_backward = torch.library.custom_op(
    "safefilter::project_backward",
    _project_backward,
    mutates_args=(),
    schema="(Tensor of_point, Tensor of_least, Tensor normals, Tensor offsets, Tensor hard, Tensor point,"
    " Tensor active, Tensor multipliers, Tensor proof, Tensor weights) -> (Tensor, Tensor, Tensor)",
)


@project_backward.register_fake
def _backward_shapes(of_point: Tensor, of_least: Tensor, *given: Tensor) -> tuple[Tensor, ...]:  # noqa: ARG001 - torch calls this with all arguments
    normals, offsets, *_ = given
    return torch.empty_like(of_point), torch.empty_like(normals), torch.empty_like(offsets)


def _keep(ctx: Any, inputs: tuple[Any, ...], output: tuple[Tensor, ...]) -> None:
    _, normals, offsets, hard, _, _ = inputs
    point, _, _, active, multipliers, proof, weights = output
    # Else torch fills a batch of zeros for every output that nobody asks the gradient of.
    ctx.set_materialize_grads(False)
    ctx.save_for_backward(normals, offsets, hard, point, active, multipliers, proof, weights)


def _differentiate(
    derivative: Operator, ctx: Any, of_point: Tensor | None, of_least: Tensor | None
) -> tuple[Tensor | None, ...]:
    point = ctx.saved_tensors[3]
    of_point = torch.zeros_like(point) if of_point is None else of_point
    of_least = torch.zeros_like(point[:, 0]) if of_least is None else of_least
    return (*derivative(of_point, of_least, *ctx.saved_tensors), None, None, None)


def _backward(
    ctx: Any, of_point: Tensor | None, of_least: Tensor | None, *_: Tensor | None
) -> tuple[Tensor | None, ...]:
    return _differentiate(project_backward, ctx, of_point, of_least)


project.register_autograd(_backward, setup_context=_keep)


class _Now(torch.autograd.Function):
    forward = staticmethod(_project)
    setup_context = staticmethod(_keep)

    @staticmethod
    def backward(
        ctx: Any, of_point: Tensor | None, of_least: Tensor | None, *_: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        # Gradients are being recorded only if somebody asks for a second derivative: the operator refuses.
        derivative = project_backward if torch.is_grad_enabled() else _project_backward
        return _differentiate(derivative, ctx, of_point, of_least)


def project_now(*question: Tensor | float) -> tuple[Tensor, ...]:
    """`project`, without torch's dispatcher unless something is being compiled."""
    call: Operator = project if torch.compiler.is_compiling() else _Now.apply
    return call(*question)

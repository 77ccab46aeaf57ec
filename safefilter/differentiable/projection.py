"""Projection: the filter's answer as a torch module, with gradients. Eqs. (17) and (18) of Qin et al.

The forward pass is a search for the rows that hold the answer, the backward pass the derivative of the answer on those
rows, in closed form (`sensitivity`). On the CPU both are compiled: the searches are those of `SafetyFilter`
(`planar_search`, `space_search`), the derivative is `sensitivity_kernel`. On CUDA both are written in torch: a dense
active set (`dense_search`), and `sensitivity` itself. What a search cannot prove, exact arithmetic answers.

It is meant to learn through, not to execute: nothing here knows of dtypes' roundings, deadlines or arcs. What executes
goes through `SafetyFilter`, as always.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from safefilter.arguments import require_kind
from safefilter.arrays import positive_number
from safefilter.differentiable.operators import project_now
from safefilter.errors import InvalidInput, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.safety_filter import TOLERANCE


class Projected(NamedTuple):
    """An answer, and what it rests on.

    Attributes:
        point: The nearest permitted action, shape (B, n), in the dtype of the action; differentiable.
        least_violation: t* in Case-3, 0 otherwise, shape (B,); differentiable with respect to rows.
        case: Values of `safefilter.Case`, shape (B,), int8.
        active: Indices of the rows that hold the point, shape (B, n), -1 for none.
        multipliers: Theirs, >= 0, shape (B, n), float64.
        proof: In Case-3 indices of the rows that contradict each other, shape (B, n + 1), -1 for none.
        weights: Theirs, those of soft rows summing to one, shape (B, n + 1), float64.
    """

    point: Tensor
    least_violation: Tensor
    case: Tensor
    active: Tensor
    multipliers: Tensor
    proof: Tensor
    weights: Tensor


class Projection(nn.Module):
    """The permitted action nearest to the wanted one, for a batch of decisions with rows of their own.

    Rows are ``normals @ v >= offsets``, of any length above zero; violations count as distances. Like the filter:

    * Case-1, all rows hold: the action itself, bit for bit.
    * Case-2: the nearest action for which they hold.
    * Case-3, they contradict each other: of all actions that violate the soft rows least (by t*), the nearest, to
      within ``tolerance`` of t*. Hard rows are never given up. So there is always an answer, unless hard rows
      contradict each other, which is an error.

    Gradients with respect to the action, the normals and the offsets are those of the answer wherever it has any. Where
    it has none, they are those of one of the pieces that meet:

    * an action on the border of a row that is not held: of the inside, the identity;
    * a row held with no force (multiplier 0): of the side on which it is held;
    * more rows through the answer than variables: of those held, named by ``active``;
    * Case-3 between two opposite rows, whose t* jumps at the slightest turn of one: as if they met in the answer.

    Everything is computed in float64 and answered in the dtype of the action. There is no second derivative, no forward
    mode and no `torch.func.vmap` (the batch is built in). `torch.compile` takes it as one operator, without a graph
    break. On CUDA, gradients of the rows are summed up in any order.

    Example:
        >>> import torch
        >>> wanted = torch.tensor([[0.3, 0.1]], requires_grad=True)
        >>> safe = Projection()(wanted, torch.tensor([[[-1.0, 0.0]]]), torch.tensor([[-0.2]]))
        >>> safe.tolist()
        [[0.20000000298023224, 0.10000000149011612]]
        >>> safe.sum().backward()
        >>> wanted.grad.tolist()
        [[0.0, 1.0]]
    """

    def __init__(self, *, tolerance: float = TOLERANCE) -> None:
        """Set the accuracy, in the unit of the action; also the slack delta in Case-3.

        Raises:
            NotFinite: If it is NaN or infinite.
            OutOfRange: If it is not above zero.
        """
        super().__init__()
        self.tolerance = positive_number(tolerance, "tolerance")

    def forward(
        self,
        action: Tensor,
        normals: Tensor,
        offsets: Tensor,
        *,
        hard: Tensor | None = None,
        present: Tensor | None = None,
    ) -> Tensor:
        """Project; arguments and errors as in `solve`."""
        return self.solve(action, normals, offsets, hard=hard, present=present).point

    def solve(
        self,
        action: Tensor,
        normals: Tensor,
        offsets: Tensor,
        *,
        hard: Tensor | None = None,
        present: Tensor | None = None,
    ) -> Projected:
        """Project, and say what the answer rests on.

        Args:
            action: Wanted actions, shape (B, n).
            normals: Shape (B, M, n), or (M, n) for rows that all decisions share.
            offsets: Shape (B, M) or (M,).
            hard: Rows that are never given up, bool, shape (B, M) or (M,); none if left out.
            present: Rows that count, bool, shape (B, M) or (M,); all if left out.

        Raises:
            ShapeError: If shapes do not belong together.
            InvalidInput: If something is no tensor, not of the kind of numbers expected, or on another device.
            NotFinite: If an action, or a row that counts, is NaN or infinite.
            OutOfRange: If the normal of a row that counts is zero.
            EmptyHardSet: If hard rows contradict each other.
        """
        _require(action, "action", action, is_mask=False)
        if action.ndim != 2 or action.shape[1] == 0:
            raise ShapeError(f"action: expected shape (B, n), got {tuple(action.shape)}")
        _require(normals, "normals", action, is_mask=False)
        _require(offsets, "offsets", action, is_mask=False)
        batch, size = action.shape
        if normals.ndim not in {2, 3}:
            raise ShapeError(
                f"normals: expected shape (B, M, n) or (M, n), got {tuple(normals.shape)}"
            )
        rows = (batch, normals.shape[-2])
        point, *rest = project_now(
            action.double(),
            _spread(normals.double(), "normals", (*rows, size)),
            _spread(offsets.double(), "offsets", rows),
            _mask(hard, "hard", action, rows, fill=False),
            _mask(present, "present", action, rows, fill=True),
            self.tolerance,
        )
        least, case, active, multipliers, proof, weights = rest
        return Projected(
            point.to(action.dtype),
            least.to(action.dtype),
            case,
            active,
            multipliers.detach(),
            proof,
            weights.detach(),
        )


def as_tensors(rows: HalfSpaces, device: torch.device | str | None = None) -> dict[str, Tensor]:
    """Copy rows of the filter to tensors, to be passed on by name.

    Args:
        rows: What `SafetyFilter.half_spaces` shows.
        device: Where they go; the CPU if left out.

    Returns:
        ``normals``, ``offsets``, ``hard`` and ``present``: ``projection(action, **as_tensors(rows))``.

    Raises:
        InvalidInput: If it is something else.
    """
    require_kind(rows, "rows", HalfSpaces)
    fields = {
        "normals": rows.normals,
        "offsets": rows.offsets,
        "hard": rows.hard,
        "present": rows.present,
    }
    return {
        name: torch.from_numpy(np.array(array)).to(device or "cpu")
        for name, array in fields.items()
    }


def _require(value: object, field: str, action: object, *, is_mask: bool) -> None:
    """Check that something is a tensor of the right kind, where the action is.

    Raises:
        InvalidInput: Otherwise.
    """
    if not isinstance(value, Tensor):
        raise InvalidInput(f"{field}: expected a tensor, got {type(value).__name__}")
    if is_mask and value.dtype != torch.bool:
        raise InvalidInput(f"{field}: expected a tensor of bool, got {value.dtype}")
    if not is_mask and not value.is_floating_point():
        raise InvalidInput(f"{field}: expected a tensor of floats, got {value.dtype}")
    if isinstance(action, Tensor) and value.device != action.device:
        raise InvalidInput(
            f"{field}: expected it on {action.device} like the action, got {value.device}; move it with .to()"
        )


def _mask(
    value: Tensor | None, field: str, action: Tensor, rows: tuple[int, int], *, fill: bool
) -> Tensor:
    if value is None:
        return action.new_full(rows, fill, dtype=torch.bool)
    _require(value, field, action, is_mask=True)
    return _spread(value, field, rows)


def _spread(value: Tensor, field: str, shape: tuple[int, ...]) -> Tensor:
    """Give every decision its own rows.

    Raises:
        ShapeError: If a value is neither of this shape nor of this one less the batch.
    """
    if tuple(value.shape) not in {shape, shape[1:]}:
        raise ShapeError(
            f"{field}: expected shape {shape} or {shape[1:]}, got {tuple(value.shape)}"
        )
    # A view that changes nothing is a step of autograd's all the same, forward and backward.
    return value if tuple(value.shape) == shape else value.expand(shape)

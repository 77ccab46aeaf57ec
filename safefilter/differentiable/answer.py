"""The answer of a batch: rows of unit length, the search that suits, exact arithmetic for what that cannot prove.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

from typing import NoReturn

import numpy as np
import torch
from torch import Tensor

from safefilter.arrays import FloatArray
from safefilter.differentiable.dense_search import dense_search
from safefilter.differentiable.exact_answer import exact_answer
from safefilter.differentiable.found import NO_ROW, Found, TensorRows
from safefilter.differentiable.planar_search import PlaneRows, planar_search
from safefilter.differentiable.products import lengths
from safefilter.errors import EmptyHardSet, NotFinite, OutOfRange
from safefilter.half_spaces import HalfSpaces

# Rows this near to length one are left as they are: those of `HalfSpaces` come back bit for bit.
UNIT_ROUNDING = 4.0 * 2.2e-16


def answer(action: Tensor, given: TensorRows, tolerance: float) -> Found:
    """Answer a batch; every answer is proved.

    Args:
        action: Shape (B, n), float64.
        given: Rows of any length above zero.
        tolerance: In the unit of the action.

    Raises:
        NotFinite: If an action or a row that is present is NaN or infinite.
        OutOfRange: If a normal is zero.
        EmptyHardSet: If hard rows contradict each other.
        BackendFailed: If even exact arithmetic did not settle.
    """
    if not bool(torch.isfinite(action).all()):
        place = int(torch.nonzero(~torch.isfinite(action).all(1))[0, 0])
        raise NotFinite(f"action of decision {place}: expected finite numbers, got NaN or infinity")
    rows = unit_rows(given)
    search = _plane if action.device.type == "cpu" and action.shape[1] == 2 else dense_search
    found = search(action, rows, tolerance)
    if not bool(found.is_proved.all()):
        _repair(found, action, rows, tolerance)
    return found


def unit_rows(given: TensorRows) -> TensorRows:
    """Divide rows by their length; absent ones become zero.

    Raises:
        NotFinite: If a row that is present is NaN or infinite.
        OutOfRange: If the normal of a row that is present is zero.
    """
    normals, offsets, hard, present = given
    length = lengths(normals)
    is_unit = (length - 1.0).abs() <= UNIT_ROUNDING
    is_finite = torch.isfinite(offsets)
    if bool((is_unit & is_finite).all()):
        return given
    is_usable = torch.isfinite(length) & (length > 0.0) & is_finite
    if not bool((is_usable | ~present).all()):
        _refuse(length, torch.nonzero(~is_usable & present)[0])
    length = torch.where(is_unit | ~is_usable, 1.0, length)
    # What is absent may be anything, but must not spread.
    normals = torch.where(is_usable[:, :, None], normals / length[:, :, None], 0.0)
    return TensorRows(normals, torch.where(is_usable, offsets / length, 0.0), hard, present)


def _refuse(length: Tensor, place: Tensor) -> NoReturn:
    """Say what is wrong with a row.

    Raises:
        NotFinite: If it is NaN or infinite.
        OutOfRange: If its normal is zero.
    """
    decision, row = place.tolist()
    if float(length[decision, row]) == 0.0:
        raise OutOfRange(
            f"normals of decision {decision}, row {row}: expected a direction, got zeros; "
            "leave rows that are absent out by present"
        )
    raise NotFinite(
        f"row {row} of decision {decision}: expected finite numbers, got NaN, infinity, or a normal too long to square"
    )


def _plane(action: Tensor, rows: TensorRows, tolerance: float) -> Found:
    """Hand a batch over to the compiled search, and take over its results."""
    arrays = PlaneRows(*(field.contiguous().numpy() for field in rows))
    out = planar_search(action.contiguous().numpy(), arrays, tolerance)
    columns = (
        out.velocity,
        out.case,
        out.active[:, ::2],
        out.multipliers,
        out.proof[:, ::2],
        out.proof_multipliers,
        out.optimal,
    )
    return Found(*(torch.from_numpy(np.ascontiguousarray(column)) for column in columns))


def _repair(found: Found, action: Tensor, rows: TensorRows, tolerance: float) -> None:
    """Answer in exact arithmetic what the search could not prove.

    Raises:
        EmptyHardSet: If hard rows contradict each other.
    """
    for k in torch.nonzero(~found.is_proved)[:, 0].tolist():
        try:
            exact = exact_answer(half_spaces_of(rows, k), action[k].cpu().numpy(), tolerance)
        except EmptyHardSet as error:
            raise EmptyHardSet(f"decision {k}: {error}") from None
        found.point[k] = torch.tensor(exact.point)
        found.case[k] = int(exact.case)
        _write(found.active[k], found.multipliers[k], exact.multipliers)
        _write(found.proof[k], found.weights[k], exact.weights)
        found.is_proved[k] = True


def half_spaces_of(rows: TensorRows, decision: int) -> HalfSpaces:
    """View the rows of one decision as those of the filter."""
    num_rows = rows.offsets.shape[1]
    labels = np.zeros((1, num_rows, 2), dtype=np.int64)
    labels[0, :, 1] = np.arange(num_rows)
    normals, offsets, hard, present = (field[decision][None].cpu().numpy().copy() for field in rows)
    return HalfSpaces(normals, offsets, hard, present, labels, ("row",))


def _write(places: Tensor, weights: Tensor, values: FloatArray) -> None:
    """Write the rows that have a number above zero into slots, the largest first."""
    order = np.argsort(-values, kind="stable")[: len(places)]
    order = order[values[order] > 0.0]
    places.fill_(NO_ROW)
    weights.zero_()
    places[: len(order)] = torch.tensor(order)
    weights[: len(order)] = torch.tensor(values[order])

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
from safefilter.differentiable.given_rows import (
    ACTION_UNUSABLE,
    ALL_USABLE,
    UNIT_ROUNDING,
    GivenRows,
)
from safefilter.differentiable.planar_search import planar_search
from safefilter.differentiable.products import lengths
from safefilter.differentiable.space_search import space_search
from safefilter.errors import EmptyHardSet, NotFinite, OutOfRange
from safefilter.half_spaces import HalfSpaces


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
    search = _compiled if action.device.type == "cpu" else _in_torch
    found = search(action, given, tolerance)
    if not bool(found.is_proved.all()):
        repair(found, action, unit_rows(given), tolerance)
    return found


def _in_torch(action: Tensor, given: TensorRows, tolerance: float) -> Found:
    """Search on any device.

    Raises:
        NotFinite: If an action or a row that is present is NaN or infinite.
        OutOfRange: If a normal is zero.
    """
    is_usable = torch.isfinite(action).all(1)
    if not bool(is_usable.all()):
        _refuse_action(int(torch.nonzero(~is_usable)[0, 0]))
    return dense_search(action, unit_rows(given), tolerance)


def _compiled(action: Tensor, given: TensorRows, tolerance: float) -> Found:
    """Hand a batch over to a compiled search, which divides rows by their lengths itself.

    Raises:
        NotFinite: If an action or a row that is present is NaN or infinite.
        OutOfRange: If a normal is zero.
    """
    arrays = GivenRows(*(field.contiguous().numpy() for field in given))
    search = planar_search if action.shape[1] == 2 else space_search
    *columns, unusable = search(action.contiguous().numpy(), arrays, tolerance)
    if (unusable != ALL_USABLE).any():
        decision = int((unusable != ALL_USABLE).argmax())
        if unusable[decision] == ACTION_UNUSABLE:
            _refuse_action(decision)
        _refuse(lengths(given.normals), decision, int(unusable[decision]))
    return Found(*map(torch.from_numpy, columns))


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
        _refuse(length, *torch.nonzero(~is_usable & present)[0].tolist())
    length = torch.where(is_unit | ~is_usable, 1.0, length)
    # What is absent may be anything, but must not spread.
    normals = torch.where(is_usable[:, :, None], normals / length[:, :, None], 0.0)
    return TensorRows(normals, torch.where(is_usable, offsets / length, 0.0), hard, present)


def _refuse_action(decision: int) -> NoReturn:
    """Say which action is not finite.

    Raises:
        NotFinite: Always.
    """
    raise NotFinite(f"action of decision {decision}: expected finite numbers, got NaN or infinity")


def _refuse(length: Tensor, decision: int, row: int) -> NoReturn:
    """Say what is wrong with a row.

    Raises:
        NotFinite: If it is NaN or infinite.
        OutOfRange: If its normal is zero.
    """
    if float(length[decision, row]) == 0.0:
        raise OutOfRange(
            f"normals of decision {decision}, row {row}: expected a direction, got zeros; "
            "leave rows that are absent out by present"
        )
    raise NotFinite(
        f"row {row} of decision {decision}: expected finite numbers, got NaN, infinity, or a normal too long to square"
    )


def repair(found: Found, action: Tensor, rows: TensorRows, tolerance: float) -> None:
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

"""What is to be decided in a `Box`: actions, what of the scene they are about, and rows, checked at the public edge.

Letters: B decisions, M rows, d dimensions. Everything in the unit of the action.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_kind
from safefilter.arrays import BoolArray, FloatArray, IntArray, number_array
from safefilter.constraints.constraint import AnyScene, Constraint
from safefilter.errors import NotFinite, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import DTYPES, Box

HOW_TO_FALL_BACK = "pass fallback= to SafetyFilter, the action to take then"


class GivenActions(NamedTuple):
    """What the policy asks for.

    Attributes:
        action: Shape (B, d), float32 or float64; the fallback in place of what was not finite.
        wanted: The same in float64.
        is_lost: Which were not finite, shape (B,).
    """

    action: npt.NDArray[np.floating]
    wanted: FloatArray
    is_lost: BoolArray


class Posed(NamedTuple):
    """Everything that a batch of decisions depends on.

    Attributes:
        given: What the policy asks for.
        entries: What of the scene the actions are about, shape (B,).
        rows: Permitted sets: rows of the box, then those of the constraints in order.
    """

    given: GivenActions
    entries: IntArray
    rows: HalfSpaces


def actions_of(
    action: npt.ArrayLike, box: Box, fallback: FloatArray | None, tolerance: float
) -> GivenActions:
    """Check actions, shape (B, d), and put the fallback in place of those that are not finite.

    Raises:
        ShapeError: If the shape is another, or they are no numbers.
        NotFinite: If one is not finite and there is no fallback.
    """
    asked = number_array(action, "action", f"numbers of shape (B, {box.dimension})")
    if asked.ndim != 2 or asked.shape[1:] != (box.dimension,) or asked.dtype.kind not in "fiu":
        raise ShapeError(
            f"action: expected numbers of shape (B, {box.dimension}), one row a decision, got {asked.dtype} of shape "
            f"{asked.shape}"
        )
    given = np.array(asked, dtype=asked.dtype if asked.dtype in DTYPES else np.float64)
    is_lost = ~np.isfinite(given).all(axis=1)
    if is_lost.any():
        if fallback is None:
            k = int(np.argmax(is_lost))
            raise NotFinite(
                f"action of row {k}: expected finite numbers, got {given[k].tolist()}; {HOW_TO_FALL_BACK}"
            )
        given[is_lost] = box.last_word(fallback[np.newaxis], given.dtype, tolerance)
    return GivenActions(given, given.astype(np.float64), is_lost)


def entries_of(index: Sequence[int] | IntArray | None, num_decisions: int) -> IntArray:
    """Check what of the scene the actions are about; None: the first B entries.

    Raises:
        ShapeError: If there is not one integer for each action.
        OutOfRange: If one is negative.
    """
    if index is None:
        return np.arange(num_decisions)
    entries = number_array(index, "index", f"an integer for each of {num_decisions} actions")
    if entries.shape != (num_decisions,) or entries.dtype.kind not in "iu":
        raise ShapeError(
            f"index: expected an integer for each of {num_decisions} actions, got {entries.dtype} of shape "
            f"{entries.shape}"
        )
    if (entries < 0).any():
        raise OutOfRange(f"index: expected entries from 0 up, got {entries.tolist()}")
    return entries.astype(np.int64)


def rows_of(
    box: Box,
    constraints: Sequence[Constraint],
    scene: AnyScene,
    wanted: FloatArray,
    entries: IntArray,
) -> HalfSpaces:
    """Ask for all rows; the scene is handed on as it is.

    Raises:
        InvalidInput: If a constraint makes something else.
        ShapeError: If it makes rows for another number of decisions or dimensions.
    """
    parts = [box.half_spaces(len(wanted))]
    for constraint in constraints:
        part = constraint.half_spaces(scene, wanted.copy(), entries)
        require_kind(part, f"{constraint.name}: rows", HalfSpaces)
        if (part.num_decisions, part.dimension) != wanted.shape:
            raise ShapeError(
                f"{constraint.name}: expected rows for {len(wanted)} decisions in {box.dimension} dimensions, got "
                f"{part.num_decisions} in {part.dimension}"
            )
        parts.append(part)
    return HalfSpaces.stacked(parts)

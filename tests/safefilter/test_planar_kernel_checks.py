"""The checks of the planar solver's own answers believe nothing that is not so."""

from __future__ import annotations

import math

import numpy as np

from safefilter.backends.planar_kernel import Rows
from safefilter.backends.planar_kernel_checks import is_nearest, is_proof

TOLERANCE = 1e-9
BOX = [(1.0, 0.0, -0.5), (0.0, 1.0, -0.5), (-1.0, 0.0, -0.5), (0.0, -1.0, -0.5)]


def is_nearest_at(point: list[float], active: list[int], multipliers: list[float]) -> bool:
    """Check a claim about the point of the box nearest to (1, 0.9)."""
    array = np.array(BOX).T.copy()
    return is_nearest(
        Rows(array, 4, 4, 0, 0.0), 0.0, 1.0, 0.9, point[0], point[1], TOLERANCE,
        np.array(active), np.array(multipliers), len(active),
    )  # fmt: skip


def test_is_nearest_believes_nothing() -> None:
    assert is_nearest_at([0.5, 0.5], [2, 3], [0.5, 0.4])
    assert is_nearest_at([0.5, 0.5], [3, 2], [0.4, 0.5])
    assert not is_nearest_at([0.5, 0.5], [2, 3], [0.4, 0.5])
    assert not is_nearest_at([0.5, 0.5], [2], [0.5])
    assert not is_nearest_at([0.5, 0.5], [2, 3], [0.5, math.nan])
    assert not is_nearest_at([0.5, 0.5 + 1e-6], [2, 3], [0.5, 0.4 - 1e-6])
    assert not is_nearest_at([0.5, 0.5 - 1e-6], [2, 3], [0.5, 0.4 + 1e-6])
    assert not is_nearest_at([0.5, 0.9], [2], [0.5])
    assert not is_nearest_at([math.nan, 0.5], [2, 3], [0.5, 0.4])
    # Rows 0 and 2 balance: the sum is right, the sign is not.
    assert not is_nearest_at([0.5, 0.5], [2, 3, 0], [-0.5, 0.4, -1.0])


def is_proof_of(
    least: float,
    proof: list[int],
    weights: list[float],
    rows: list[tuple[float, float, float]] | None = None,
) -> bool:
    """Check a claim about t* of two soft rows 0.2 apart in the box: 0.1."""
    soft = rows or [(1.0, 0.0, 0.1), (-1.0, 0.0, 0.1)]
    array = np.array([*BOX, *soft]).T.copy()
    return is_proof(
        Rows(array, len(BOX) + len(soft), 4, 0, 0.0), least, 1.0, TOLERANCE,
        np.array(proof), np.array(weights), len(proof),
    )  # fmt: skip


def test_is_proof_believes_nothing() -> None:
    assert is_proof_of(0.1, [4, 5], [0.5, 0.5])
    assert is_proof_of(0.05, [4, 5], [0.5, 0.5])
    assert not is_proof_of(0.1 + 1e-8, [4, 5], [0.5, 0.5])
    assert not is_proof_of(0.1, [4, 5], [0.6, 0.4])
    assert not is_proof_of(0.1, [4, 5], [1.0, 1.0])
    assert not is_proof_of(0.1, [4], [1.0])
    assert not is_proof_of(0.1, [4, 5], [0.5, math.nan])
    assert not is_proof_of(0.1, [4, 5], [1.5, -0.5])
    assert not is_proof_of(0.1, [0, 2], [1.0, 1.0])

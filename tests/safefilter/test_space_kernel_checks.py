"""The checks of the solver's own answers in space believe nothing that is not so."""

from __future__ import annotations

import math

import numpy as np
import pytest

from safefilter.backends.planar_kernel import Rows
from safefilter.backends.space_kernel import Held, make_room
from safefilter.backends.space_kernel_checks import is_nearest, is_proof

TOLERANCE = 1e-9
CUBE = np.hstack([np.concatenate([np.eye(3), -np.eye(3)]), np.full((6, 1), -0.5)])
OPPOSITE = np.array([[0.0, 0.0, 1.0, 0.1], [0.0, 0.0, -1.0, 0.1]])


def held(rows: list[int], weights: list[float]) -> Held:
    return Held(np.array(rows, dtype=np.int64), np.array(weights))


def is_nearest_at(point: list[float], rows: list[int], weights: list[float]) -> bool:
    """Check a claim about the point of the cube nearest to (1, 0.9, -0.8)."""
    wanted = np.array([1.0, 0.9, -0.8])
    system = Rows(CUBE.T.copy(), 6, 6, 0, 0.0)
    claim = held(rows, weights)
    return is_nearest(
        system, 0.0, wanted, np.array(point), TOLERANCE, claim, len(rows), make_room(3, 6)
    )


def test_is_nearest_believes_what_is_so() -> None:
    assert is_nearest_at([0.5, 0.5, -0.5], [3, 4, 2], [0.5, 0.4, 0.3])
    assert is_nearest_at([0.5, 0.5, -0.5], [2, 4, 3], [0.3, 0.4, 0.5])


@pytest.mark.parametrize(
    ("point", "rows", "weights"),
    [
        ([0.5, 0.5, -0.5], [3, 4, 2], [0.4, 0.5, 0.3]),
        ([0.5, 0.5, -0.5], [3, 4], [0.5, 0.4]),
        ([0.5, 0.5, -0.5], [3, 4, 2], [0.5, 0.4, math.nan]),
        ([0.5, 0.5, -0.5 - 1e-6], [3, 4, 2], [0.5, 0.4, 0.3 - 1e-6]),
        ([0.5, 0.5, -0.5 + 1e-6], [3, 4, 2], [0.5, 0.4, 0.3 + 1e-6]),
        ([0.5, 0.5, -0.8], [3, 4], [0.5, 0.4]),
        ([math.nan, 0.5, -0.5], [3, 4, 2], [0.5, 0.4, 0.3]),
        # Rows 0 and 3 balance: the sum is right, the sign is not.
        ([0.5, 0.5, -0.5], [3, 4, 2, 0], [-0.5, 0.4, 0.3, -1.0]),
    ],
)
def test_is_nearest_believes_nothing_else(
    point: list[float], rows: list[int], weights: list[float]
) -> None:
    assert not is_nearest_at(point, rows, weights)


def is_proof_of(least: float, rows: list[int], weights: list[float], radius: float = 1.0) -> bool:
    """Check a claim about t* of two soft rows 0.2 apart in the cube: 0.1."""
    system = Rows(np.concatenate([CUBE, OPPOSITE]).T.copy(), 8, 6, 0, 0.0)
    claim = held(rows, weights)
    return is_proof(system, least, radius, TOLERANCE, claim, len(rows), np.empty(3))


def test_is_proof_believes_what_is_so() -> None:
    assert is_proof_of(0.1, [6, 7], [0.5, 0.5])
    assert is_proof_of(0.05, [7, 6], [0.5, 0.5])


@pytest.mark.parametrize(
    ("least", "rows", "weights"),
    [
        (0.1 + 1e-8, [6, 7], [0.5, 0.5]),
        (0.1, [6, 7], [0.6, 0.4]),
        (0.1, [6, 7], [1.0, 1.0]),
        (0.1, [6], [1.0]),
        (0.1, [], []),
        (0.1, [6, 7], [0.5, math.nan]),
        (0.1, [6, 7, 0], [0.5, 0.5, -0.1]),
        (0.1, [0, 3], [0.5, 0.5]),
    ],
)
def test_is_proof_believes_nothing_else(
    least: float, rows: list[int], weights: list[float]
) -> None:
    assert not is_proof_of(least, rows, weights)


def test_normals_that_do_not_cancel_prove_less_the_larger_the_set_is() -> None:
    # The residual of 1e-4 may be worth as much times the radius.
    assert is_proof_of(0.0999, [6, 7], [0.50005, 0.49995], radius=0.5)
    assert not is_proof_of(0.0999, [6, 7], [0.50005, 0.49995], radius=5.0)

"""Worlds that kernels could not read are refused, and so are wishes and choices that are not of all their robots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.outlines import OwnWalls

NUM_WORLDS, NUM_ROBOTS = 3, 4
SAFETY = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
)


def make(**changed: object) -> dict[str, Any]:
    """Arguments of worlds whose robots stand 1 m from each other."""
    each, position = np.ones((NUM_WORLDS, NUM_ROBOTS)), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2))
    position[..., 0] = np.arange(NUM_ROBOTS)
    return {
        "position": position,
        "velocity": np.zeros_like(position),
        "radius": 0.1 * each,
        "priority": each,
        "cooperative": each > 0.0,
        "present": each > 0.0,
        "heading": 0.0 * each,
        **changed,
    }


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("position", [[[0.0, 0.0]]], "position: expected an array"),
        ("position", np.zeros((3, 4)), "position: expected an array"),
        ("position", np.zeros((3, 4, 3)), "position: expected an array"),
        ("position", np.zeros((3, 4, 2), dtype=np.float32), "position: .* float64"),
        ("velocity", np.zeros((3, 4, 3)), r"velocity: .* \(3, 4, 2\)"),
        ("velocity", np.zeros((2, 3, 4)).T[..., :2], "velocity"),
        ("velocity", np.zeros((3, 4, 4))[..., ::2], "velocity: .* not C-contiguous"),
        ("radius", 0.1, "radius: .* got float"),
        ("priority", np.ones((4, 3)), "priority"),
        ("cooperative", np.ones((3, 4)), "cooperative: .* bool"),
        ("present", np.ones((3, 4), dtype=int), "present: .* bool"),
        ("heading", np.ones(12), "heading"),
        ("own_walls", OwnWalls.none(3), "ranges of 3 robots"),
    ],
)
def test_arrays_of_another_kind_are_refused(field: str, value: object, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        sf.Worlds(**{**make(), field: value})


@pytest.mark.parametrize("reach", [0.0, -1.0, np.nan])
def test_a_reach_is_above_zero(reach: float) -> None:
    with pytest.raises(OutOfRange, match="reach"):
        sf.Worlds(**make(reach=reach))


def test_walls_are_own_walls() -> None:
    with pytest.raises(InvalidInput, match="own_walls"):
        sf.Worlds(**make(own_walls=np.zeros((1, 2, 2))))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros((NUM_WORLDS * NUM_ROBOTS, 2)), r"\(3, 4, 2\)"),
        (np.zeros((NUM_WORLDS, NUM_ROBOTS, 2), dtype=bool), "got bool"),
        ("left", "action"),
    ],
)
def test_actions_are_of_all_robots(action: Any, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        SAFETY.decide_worlds(sf.Worlds(**make()), action)


@pytest.mark.parametrize("chosen", [[True], np.ones((NUM_WORLDS, NUM_ROBOTS)), np.ones(12, bool)])
def test_robots_are_chosen_by_flags(chosen: Any) -> None:
    with pytest.raises(ShapeError, match="chosen: expected an array of bools"):
        SAFETY.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)), chosen)


def test_worlds_are_worlds() -> None:
    with pytest.raises(InvalidInput, match="worlds: expected Worlds, got Scene"):
        SAFETY.decide_worlds(sf.Worlds(**make()).scene(), np.zeros((3, 4, 2)))  # type: ignore[arg-type]


@pytest.mark.parametrize("wanted", [np.zeros((3, 4)), np.zeros((3, 4, 2), dtype=np.float32)])
def test_wanted_velocities_are_of_all_robots(wanted: Any) -> None:
    with pytest.raises(ShapeError, match="wanted"):
        sf.Worlds(**make()).scene(wanted=wanted)

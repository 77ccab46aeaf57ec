"""Scenes that make no sense are refused, and the message names robot and field."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from safefilter.errors import InvalidInput, NotFinite, OutOfRange, ShapeError
from safefilter.neighbours import UNLIMITED_LIMIT
from safefilter.scene import Scene
from safefilter.usable_state import MAX_COORDINATE

GIVEN: dict[str, Any] = {
    "position": [[0.0, 1.0], [2.0, 3.0], [9.0, 9.0]],
    "velocity": [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]],
    "radius": [0.1, 0.2, 0.3],
}


def scene(**changes: Any) -> Scene:  # wrong values are the point
    return Scene.from_world(**{**GIVEN, **changes})


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"position": [0.0, 1.0]}, ShapeError, "position: expected shape (N, 2 or 3), got (2,)"),
        (
            {"position": np.zeros((3, 4))},
            ShapeError,
            "position: expected shape (N, 2 or 3), got (3, 4)",
        ),
        ({"velocity": np.zeros((2, 2))}, ShapeError, "velocity: expected shape (3, 2), got (2, 2)"),
        ({"wanted": np.zeros((3, 1))}, ShapeError, "wanted: expected shape (3, 2), got (3, 1)"),
        ({"radius": [0.1, 0.2]}, ShapeError, "radius: expected shape (3,), got (2,)"),
        ({"priority": np.ones((3, 1))}, ShapeError, "priority: expected shape (3,), got (3, 1)"),
        ({"heading": [0.0]}, ShapeError, "heading: expected shape (3,), got (1,)"),
        (
            {"cooperative": [1, 0, 1]},
            ShapeError,
            "cooperative: expected a bool or bools of shape (3,), got int64 of shape (3,)",
        ),
        (
            {"cooperative": [True, False]},
            ShapeError,
            "cooperative: expected a bool or bools of shape (3,), got bool of shape (2,)",
        ),
        (
            {"world": 0.0},
            ShapeError,
            "world: expected an integer or integers of shape (3,), got float64 of shape ()",
        ),
        (
            {"world": [0, 1]},
            ShapeError,
            "world: expected an integer or integers of shape (3,), got int64 of shape (2,)",
        ),
        (
            {"position": [[0.0, 0.0], [1.0, math.nan], [0.0, 0.0]]},
            NotFinite,
            "position of row 1: expected a finite number, got [ 1. nan]",
        ),
        (
            {"velocity": [[0.0, 0.0], [0.0, 0.0], [math.inf, 0.0]]},
            NotFinite,
            "velocity of row 2: expected a finite number, got [inf  0.]",
        ),
        (
            {"wanted": [[math.nan, 0.0], [0.0, 0.0], [0.0, 0.0]]},
            NotFinite,
            "wanted of row 0: expected a finite number, got [nan  0.]",
        ),
        (
            {"radius": [0.1, math.inf, 0.1]},
            NotFinite,
            "radius of row 1: expected a finite number, got inf",
        ),
        ({"radius": math.nan}, NotFinite, "radius of row 0: expected a finite number, got nan"),
        (
            {"priority": [1.0, 1.0, math.nan]},
            NotFinite,
            "priority of row 2: expected a finite number, got nan",
        ),
        (
            {"heading": [0.0, -math.inf, 0.0]},
            NotFinite,
            "heading of row 1: expected a finite number, got -inf",
        ),
        (
            {"radius": [0.1, 0.1, 0.0]},
            OutOfRange,
            "radius of row 2: expected a number above 0, got 0.0",
        ),
        ({"radius": -1.0}, OutOfRange, "radius of row 0: expected a number above 0, got -1.0"),
        (
            {"priority": [1.0, 0.0, 1.0]},
            OutOfRange,
            "priority of row 1: expected a number above 0, got 0.0",
        ),
        ({"priority": -2.0}, OutOfRange, "priority of row 0: expected a number above 0, got -2.0"),
        (
            {"priority": [1.0, 1e151, 1.0]},
            OutOfRange,
            "priority of row 1: expected 1e-150 to 1e+150, got 1e+151",
        ),
        (
            {"priority": [1.0, 1.0, 1e-151]},
            OutOfRange,
            "priority of row 2: expected 1e-150 to 1e+150, got 1e-151",
        ),
        (
            {"position": [[0.0, 0.0], [0.0, 0.0], [0.0, -2e100]]},
            OutOfRange,
            "position of row 2: expected magnitudes up to 1e+100, got [ 0.e+000 -2.e+100]",
        ),
        (
            {"radius": [0.1, 2e100, 0.1]},
            OutOfRange,
            "radius of row 1: expected magnitudes up to 1e+100, got 2e+100",
        ),
        ({"reach": 0.0}, OutOfRange, "reach: expected a distance above 0 m, got 0.0"),
        ({"reach": -1.0}, OutOfRange, "reach: expected a distance above 0 m, got -1.0"),
        ({"reach": math.nan}, OutOfRange, "reach: expected a distance above 0 m, got nan"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(
    change: dict[str, Any], error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        scene(**change)
    assert str(caught.value) == message
    assert isinstance(caught.value, InvalidInput)


@pytest.mark.parametrize("field", ["velocity", "wanted"])
def test_huge_velocities_are_refused(field: str) -> None:
    with pytest.raises(OutOfRange, match=rf"^{field} of row 0: expected magnitudes up to 1e\+100"):
        scene(**{field: np.full((3, 2), 2.0 * MAX_COORDINATE)})


def test_many_robots_need_a_reach() -> None:
    many = np.zeros((UNLIMITED_LIMIT + 1, 2))
    many[:, 0] = np.arange(len(many))
    with pytest.raises(OutOfRange) as caught:
        Scene.from_world(many, np.zeros_like(many), 0.1)
    assert str(caught.value) == (
        "reach: 5001 robots that all see each other make 2.5e+07 pairs; pass reach= (in m)"
    )
    assert Scene.from_world(many, np.zeros_like(many), 0.1, reach=1.0).most_neighbours == 2

"""Which velocities a half-plane is built around."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter import Scene
from safefilter.constraints.v_opt import CURRENT, OWN, SHARED, optimisation_velocities

STATE = Scene.from_world(
    [[0.0, 0.0], [9.0, 9.0]], [[1.0, 2.0], [3.0, 4.0]], 0.1, wanted=[[5.0, 6.0], [7.0, 8.0]]
).state


@pytest.mark.parametrize(
    ("v_opt", "expected"),
    [
        (CURRENT, (1.0, 2.0, 3.0, 4.0)),
        (SHARED, (5.0, 6.0, 7.0, 8.0)),
        (OWN, (0.1, 0.2, 3.0, 4.0)),
    ],
)
def test_by_hand(v_opt: int, expected: tuple[float, ...]) -> None:
    assert optimisation_velocities(STATE, v_opt, 0, 1, 0.1, 0.2) == expected


@pytest.mark.parametrize("v_opt", [CURRENT, SHARED])
def test_both_robots_of_a_pair_take_the_same_two_velocities(v_opt: int) -> None:
    own = optimisation_velocities(STATE, v_opt, 0, 1, np.nan, np.nan)
    other = optimisation_velocities(STATE, v_opt, 1, 0, np.nan, np.nan)
    assert own[:2] == other[2:]
    assert own[2:] == other[:2]

"""How far robots must see for separation, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from safefilter import Holonomic, SafetyFilter
from safefilter.constraints.separation import Separation
from safefilter.errors import NotFinite, OutOfRange
from safefilter.scene import Scene
from safefilter.uncertainty import Uncertainty

DT = 0.25


def pair(gap: float, *, cooperative: bool = True, velocity: float = 0.0) -> Scene:
    """Robots of radius 0.5 m on the x axis; the other one moves along it."""
    return Scene.from_world(
        [[0.0, 0.0], [1.0 + gap, 0.0]],
        [[0.0, 0.0], [velocity, 0.0]],
        0.5,
        priority=[1.0, 3.0],
        cooperative=[True, cooperative],
    )


def test_required_reach_by_hand() -> None:
    # Radii 0.5 and 0.5; 2 m/s and 1 m/s for a quarter of a second; margin 0.25.
    limits = np.array([2.0, 1.0])
    separation = Separation(DT, 0.25)
    assert separation.required_reach(pair(5.0), limits) == 1.0 + 1.0 + 0.25
    # A passive robot is seen to move with 10 m/s, or may.
    fast = pair(5.0, cooperative=False, velocity=10.0)
    assert separation.required_reach(fast, limits) == 1.0 + 0.5 + 2.5 + 0.25
    sudden = Separation(DT, 0.25, passive_speed=20.0)
    assert sudden.required_reach(fast, limits) == 1.0 + 0.5 + 5.0 + 0.25


def test_required_reach_with_errors_by_hand() -> None:
    bounds = Uncertainty(
        position_error=0.125,
        velocity_error=2.0,
        observation_delay=0.5,
        actuation_delay=0.25,
        actuation_error=0.5,
    )
    separation = Separation(DT, 0.25, uncertainty=bounds)
    # 3 m/s at most are executed, or 2 + 10 m/s of one that does not cooperate, for 0.5 s; before, for 0.75 s.
    passive = pair(5.0, cooperative=False, velocity=10.0)
    found = separation.required_reach(passive, np.array([2.0, 1.0]))
    assert found == pytest.approx(1.0 + 0.25 + 2 * 0.125 + (3.0 + 12.0) * (0.5 + 0.75))
    both = separation.required_reach(pair(5.0), np.array([2.0, 1.0]))
    assert both == pytest.approx(1.0 + 0.25 + 2 * 0.125 + (3.0 + 3.0) * (0.5 + 0.75))


def test_nobody_needs_no_reach() -> None:
    nobody = Scene.from_world(np.zeros((0, 2)), np.zeros((0, 2)), 0.1)
    assert Separation(DT).required_reach(nobody, np.empty(0)) == 0.0


def test_a_reach_that_is_too_short_is_refused() -> None:
    scene = Scene.from_world([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.1, reach=0.25)
    safety = SafetyFilter([Separation(DT, 0.0)], Holonomic(0.2))
    with pytest.raises(OutOfRange, match=r"^reach: hard rows need every neighbour within 0\.3 m"):
        safety.decide(scene, np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"dt": 0.0}, OutOfRange, "dt: expected a number above 0, got 0.0"),
        ({"dt": math.nan}, NotFinite, "dt: expected a finite number, got nan"),
        (
            {"safety_margin": -1e-6},
            OutOfRange,
            "safety_margin: expected a finite number from 0 up, got -1e-06",
        ),
        (
            {"safety_margin": math.nan},
            OutOfRange,
            "safety_margin: expected a finite number from 0 up, got nan",
        ),
        (
            {"passive_speed": math.inf},
            OutOfRange,
            "passive_speed: expected a finite number from 0 up, got inf",
        ),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    settings: dict[str, Any], error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        Separation(**{"dt": DT, **settings})
    assert str(caught.value) == message

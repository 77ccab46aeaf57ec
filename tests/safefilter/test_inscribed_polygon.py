from __future__ import annotations

import math

import numpy as np
import pytest

import safefilter as sf
from safefilter.kinematics.inscribed_polygon import inscribed_polygon


@pytest.mark.parametrize("error", [0.01, 0.02, 0.05, 0.1])
def test_every_velocity_of_the_polygon_is_tracked_within_the_error(error: float) -> None:
    drive = sf.DifferentialDrive(0.2, 2.5, 0.2, error, mapping="polygon")
    for angle in np.linspace(-math.pi, math.pi, 1000):
        along = drive.sides[0] * math.cos(angle) + drive.sides[1] * math.sin(angle)
        leaving = along < -1e-12
        reach = 0.2 * float((drive.sides[2][leaving] / along[leaving]).min())
        assert reach <= drive.tracked_speed(float(angle)) * (1.0 + 1e-6)


def test_a_disc_yields_a_polygon_that_all_but_fills_half_of_it() -> None:
    sides, inner_radius = inscribed_polygon(lambda _: 1.0, 1.0)
    assert (sides[2] < 0.0).all()
    assert 0.5 < inner_radius <= 1.0
    np.testing.assert_allclose(np.hypot(sides[0], sides[1]), 1.0)


def test_a_set_that_no_polygon_fits_is_refused() -> None:
    # Nothing at all behind: the origin cannot be inside.
    with pytest.raises(ValueError, match="it leaves no polygon of velocities"):
        inscribed_polygon(lambda angle: 1.0 if abs(angle) < 1.0 else 0.0, 1.0)

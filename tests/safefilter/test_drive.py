from __future__ import annotations

import math

import numpy as np

from safefilter.kinematics.drive import NO_DRIVE, with_wanted_velocities


def test_commands_become_the_chords_of_their_arcs() -> None:
    heading = np.array([0.0, math.pi / 2, 1.0])
    # Robot 1 goes straight north; robot 0 makes a quarter of a circle of radius 1 m.
    command = np.array([[0.5, 0.0], [1.0, 1.0]])
    found = with_wanted_velocities(command, heading, np.array([1, 0]), math.pi / 2)
    expected = [[0.0, math.pi / 4], [1.0, 1.0]]
    np.testing.assert_allclose(found[:, :2] * math.pi / 2, expected, atol=1e-12)
    np.testing.assert_array_equal(found[:, 2:], command)


def test_no_drive_is_not_used() -> None:
    assert not NO_DRIVE.is_used
    assert not NO_DRIVE.has_polygon

"""Tests of the map from networks to commands."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from policies.action_map import to_command, to_raw
from safefilter.arrays import FloatArray

V_MAX, OMEGA_MAX = np.array(0.2), np.array(2.5)
UNIT = st.floats(-1.0, 1.0)


def _command(first: float, second: float) -> FloatArray:
    return to_command(np.array([first, second]), V_MAX, OMEGA_MAX)


def test_a_silent_network_goes_forward_at_half_speed() -> None:
    assert _command(0.0, 0.0).tolist() == [0.1, 0.0]


def test_the_ends_are_the_limits_of_the_drive() -> None:
    assert _command(1.0, 1.0).tolist() == [0.2, 2.5]
    assert _command(-1.0, -1.0).tolist() == [0.0, -2.5]


@given(st.floats(1.0, 1e6), st.floats(1.0, 1e6))
def test_beyond_the_ends_is_the_end(first: float, second: float) -> None:
    assert _command(first, -second).tolist() == [0.2, -2.5]


@given(UNIT, UNIT, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_there_and_back(first: float, second: float, v_max: float, omega_max: float) -> None:
    limits = np.array(v_max), np.array(omega_max)
    raw = np.array([first, second])
    np.testing.assert_allclose(to_raw(to_command(raw, *limits), *limits), raw, atol=1e-12)


@given(UNIT, UNIT)
def test_a_mirrored_network_turns_the_other_way(first: float, second: float) -> None:
    np.testing.assert_array_equal(_command(first, -second), _command(first, second) * [1.0, -1.0])


def test_each_robot_has_its_own_limits() -> None:
    raw = np.ones((3, 2, 2))
    v_max = np.arange(1.0, 7.0).reshape(3, 2)
    command = to_command(raw, v_max, np.full((3, 2), 2.0))
    np.testing.assert_array_equal(command[..., 0], v_max)
    assert (command[..., 1] == 2.0).all()

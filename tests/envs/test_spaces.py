from typing import Any

import gymnasium
import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from envs.spaces import action_space, in_form, observation_space
from safefilter.errors import InvalidInput

LAYOUT = ObservationLayout(2, 4, has_memory=True)


def test_velocities_are_bounded_each_way_and_commands_do_not_go_back() -> None:
    velocity: Any = action_space("holonomic", 0.2, 2.5)
    command: Any = action_space("differential", 0.2, 2.5)
    np.testing.assert_array_equal(velocity.low, np.array([-0.2, -0.2], dtype=np.float32))
    np.testing.assert_array_equal(command.low, np.array([0.0, -2.5], dtype=np.float32))
    np.testing.assert_array_equal(command.high, np.array([0.2, 2.5], dtype=np.float32))


def test_both_forms_hold_the_same_numbers() -> None:
    flat = np.linspace(-1.0, 1.0, LAYOUT.size, dtype=np.float32)
    assert in_form(LAYOUT, flat, "flat") is flat
    named = in_form(LAYOUT, flat, "dict")
    assert isinstance(named, dict)
    assert list(named) == ["own", "neighbours", "lidar", "memory"]
    np.testing.assert_array_equal(np.concatenate([part.ravel() for part in named.values()]), flat)


def test_observations_are_in_the_space_of_their_form() -> None:
    flat = np.zeros(LAYOUT.size, dtype=np.float32)
    box, named = observation_space(LAYOUT, "flat"), observation_space(LAYOUT, "dict")
    assert box.contains(flat)
    assert isinstance(named, gymnasium.spaces.Dict)
    assert named.contains(in_form(LAYOUT, flat, "dict"))
    assert not box.contains(flat[1:])


def test_an_unknown_form_is_refused() -> None:
    with pytest.raises(InvalidInput, match="observation: expected one of flat, dict, got 'list'"):
        observation_space(LAYOUT, "list")  # type: ignore[arg-type]  # the point of the test

"""Robots under way do what they are told, all others stand."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import Crossroad, Navigation
from envs.under_way import actions_of_active, find_active
from safefilter.errors import ShapeError

FLAGS = ("present", "arrived", "collided", "person")


@given(seed=st.integers(0, 2**32), dtype=st.sampled_from((np.float32, np.float64)))
def test_only_who_has_a_body_and_neither_arrived_nor_collided_nor_is_a_person(
    seed: int, dtype: type[np.floating]
) -> None:
    rng = np.random.default_rng(seed)
    present, arrived, collided, person = (rng.random((3, 4)) < 0.7 for _ in FLAGS)
    actions = rng.normal(size=(3, 4, 2)).astype(dtype)
    expected = present & ~arrived & ~collided & ~person
    np.testing.assert_array_equal(find_active(present, arrived, collided, person), expected)
    found = actions_of_active(actions, present, arrived, collided, person)
    np.testing.assert_array_equal(
        found, np.where(expected[..., np.newaxis], actions, dtype(0.0)), strict=True
    )
    assert not np.shares_memory(found, actions)


@pytest.mark.parametrize(
    ("actions", "dtype"),
    [
        (np.ones((2, 8, 2)), np.float64),
        (np.ones((2, 8, 2), dtype=np.float32), np.float32),
        (np.ones((2, 8, 2), dtype=np.int64), np.float64),
        (np.ones((2, 8, 2), dtype=np.float16), np.float64),
        (np.ones((2, 8, 2), dtype=">f8"), np.float64),
        (np.ones((2, 2, 8)).swapaxes(1, 2), np.float64),
    ],
    ids=["double", "single", "integers", "half", "big-endian", "transposed"],
)
def test_what_is_wanted_is_told_of_robots_under_way(
    actions: npt.NDArray[Any], dtype: type[np.floating]
) -> None:
    navigation = Navigation(Crossroad(), num_worlds=2)
    navigation.reset(0)
    navigation.world.arrived[1, 3] = True
    wanted = navigation.wanted(actions)
    assert wanted.dtype == dtype
    assert wanted.sum() == 2 * (2 * 8 - 1)
    assert (wanted[1, 3] == 0.0).all()


def test_actions_are_of_all_robots() -> None:
    navigation = Navigation(Crossroad(), num_worlds=2)
    navigation.reset(0)
    with pytest.raises(ShapeError, match=r"actions: expected shape \(2, 8, 2\)"):
        navigation.wanted(np.zeros((1, 8, 2)))

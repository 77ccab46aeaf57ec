import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.trail import (
    NUM_PLACES,
    NUM_SECTORS,
    SCALE,
    UNDERFOOT,
    add_up_trail,
    sector,
    weight_of_place,
)
from safefilter.arrays import FloatArray
from safefilter.jit import source_of

angles = st.floats(-math.pi, math.pi)


def _total(places: FloatArray, count: int, heading: float = 0.0) -> FloatArray:
    total = np.full(NUM_SECTORS, np.nan)
    kept = np.zeros((NUM_PLACES, 2), dtype=np.float32)
    kept[: len(places)] = places
    source_of(add_up_trail)(kept, count, 0.0, 0.0, math.cos(heading), math.sin(heading), total)
    return total


@pytest.mark.parametrize("number", range(NUM_SECTORS))
def test_middles_of_sectors(number: int) -> None:
    angle = number * math.pi / 4
    assert source_of(sector)(math.cos(angle), math.sin(angle)) == number


@given(angles)
def test_sectors_are_those_of_the_angle(angle: float) -> None:
    off = abs(math.remainder(angle, math.pi / 4))
    if abs(off - math.pi / 8) > 1e-9:
        expected = round(angle / (math.pi / 4)) % NUM_SECTORS
        assert source_of(sector)(math.cos(angle), math.sin(angle)) == expected


@given(angles, st.floats(1e-3, 10.0))
def test_a_mirrored_direction_is_in_the_mirrored_sector(angle: float, length: float) -> None:
    ahead, left = length * math.cos(angle), length * math.sin(angle)
    if abs(abs(math.remainder(angle, math.pi / 4)) - math.pi / 8) > 1e-9 and left != 0.0:
        mirrored = source_of(sector)(ahead, -left)
        assert (mirrored + source_of(sector)(ahead, left)) % NUM_SECTORS == 0


def test_weights_by_hand() -> None:
    assert source_of(weight_of_place)(0.0) == 1.0
    assert source_of(weight_of_place)(SCALE**2) == 0.25


def test_places_by_hand() -> None:
    places = np.array([
        [SCALE, 0.0],
        [0.0, SCALE],
        [0.0, SCALE],
        [-1e6, 0.0],
        [0.0, 0.9 * UNDERFOOT],
    ])
    np.testing.assert_allclose(_total(places, 5), [0.25, 0, 0.5, 0, 0, 0, 0, 0], atol=1e-9)


def test_only_what_was_remembered_counts() -> None:
    places = np.array([[SCALE, 0.0], [SCALE, 0.0], [SCALE, 0.0]])
    assert _total(places, 0).sum() == 0.0
    assert _total(places, 1)[0] == pytest.approx(0.25)
    # Once the ring is full all of it counts, however much has been forgotten since.
    assert _total(np.full((NUM_PLACES, 2), SCALE), 10 * NUM_PLACES).sum() == pytest.approx(
        NUM_PLACES / 9
    )


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), max_size=NUM_PLACES), angles)
def test_all_places_count_whatever_the_heading(
    points: list[tuple[float, float]], heading: float
) -> None:
    places = np.array(points).reshape(-1, 2)
    straight, turned = _total(places, len(places)), _total(places, len(places), heading)
    assert turned.sum() == pytest.approx(straight.sum(), rel=1e-5, abs=1e-6)

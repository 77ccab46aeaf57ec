import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.scenarios.town_avenues import HALF_WIDTH, Avenues
from envs.scenarios.town_cells import PITCH

seeds = st.integers(0, 2**32 - 1)


def test_a_crossroad_by_hand() -> None:
    town = Avenues(3, rows=((1, 0.5),), columns=((1, 0.6),))
    assert town.blocks == [0, 2, 6, 8]
    edge = 1.5 * PITCH
    walls = np.concatenate(town.walls)
    assert len(town.walls) == 4
    # The houses leave 1.2 m between west and east, and 1.0 m between south and north.
    assert sorted({*np.round(walls[..., 0].ravel(), 9)}) == pytest.approx([-edge, -0.6, 0.6, edge])
    assert sorted({*np.round(walls[..., 1].ravel(), 9)}) == pytest.approx([-edge, -0.5, 0.5, edge])


@given(seeds, st.integers(3, 9), st.integers(0, 81))
def test_streets_cross_and_are_enough(seed: int, size: int, least: int) -> None:
    town = Avenues.draw(np.random.default_rng(seed), size, least)
    assert town.rows
    assert town.columns
    assert size * size - len(town.blocks) >= min(least, size * size)
    for number, half_width in (*town.rows, *town.columns):
        assert 0 <= number < size
        assert HALF_WIDTH[0] <= half_width <= HALF_WIDTH[1]


@given(seeds, st.integers(3, 9))
def test_what_is_built_leaves_the_avenues_free(seed: int, size: int) -> None:
    town = Avenues.draw(np.random.default_rng(seed), size, 0)
    middle = PITCH * (np.arange(size) + 0.5 - size / 2)
    for walls in town.walls:
        (west, south), (east, north) = walls.min(axis=(0, 1)), walls.max(axis=(0, 1))
        for number, half_width in town.columns:
            assert (
                east <= middle[number] - half_width + 1e-9
                or west >= middle[number] + half_width - 1e-9
            )
        for number, half_width in town.rows:
            assert (
                north <= middle[number] - half_width + 1e-9
                or south >= middle[number] + half_width - 1e-9
            )


def test_more_streets_join_those_that_were_drawn() -> None:
    few = Avenues.draw(np.random.default_rng(5), 9, 0)
    many = Avenues.draw(np.random.default_rng(5), 9, 60)
    assert set(few.rows) <= set(many.rows)
    assert set(few.columns) <= set(many.columns)
    assert len(many.blocks) <= 81 - 60

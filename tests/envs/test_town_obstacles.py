import numpy as np
import pytest

from envs.scenarios.town_cells import PITCH, cell_centres, sides_of_cells
from envs.scenarios.town_obstacles import (
    DEEP,
    PILLAR,
    PILLAR_GAP,
    SHALLOW,
    THICKNESS,
    WIDE,
    WIDTH,
    ObstacleDrawer,
    Trap,
)
from envs.scenarios.wall_kernel import wall_distances

SIZE = 4
SQUARE = [5, 6, 9, 10]


def _drawer(seed: int) -> ObstacleDrawer:
    return ObstacleDrawer(np.random.default_rng(seed), SIZE, sides_of_cells(SIZE))


def _extent(trap: Trap) -> list[float]:
    points = trap.outline.reshape(-1, 2)
    extent: list[float] = (points.max(axis=0) - points.min(axis=0)).tolist()
    return extent


@pytest.mark.parametrize("seed", range(12))
def test_the_middle_of_a_trap_is_that_of_its_cells(seed: int) -> None:
    drawer = _drawer(seed)
    deep = drawer.deep(SQUARE)
    assert deep is not None
    for trap in (drawer.in_square(SQUARE, may_be_deep=True), deep, drawer.shallow(6)):
        points = trap.outline.reshape(-1, 2)
        middle = (points.max(axis=0) + points.min(axis=0)) / 2
        cells = cell_centres(np.array(trap.cells), SIZE).mean(axis=0)
        np.testing.assert_allclose(middle, cells, atol=1e-9)
        sides = sorted(_extent(trap))
        np.testing.assert_allclose(
            sides, sorted([trap.depth + THICKNESS, trap.width + 2 * THICKNESS]), atol=1e-9
        )


@pytest.mark.parametrize("seed", range(12))
def test_sizes_are_within_their_limits(seed: int) -> None:
    drawer = _drawer(seed)
    deep = drawer.deep(SQUARE)
    assert deep is not None
    assert DEEP[0] <= deep.depth <= DEEP[1]
    assert deep.width == WIDTH
    assert not set(deep.cells) & set(SQUARE)
    shallow = drawer.shallow(0)
    assert SHALLOW[0] <= shallow.depth <= SHALLOW[1]
    wide = drawer.in_square(SQUARE, may_be_deep=False)
    assert WIDE[0] <= wide.width <= WIDE[1]
    assert SHALLOW[0] <= wide.depth <= SHALLOW[1]


@pytest.mark.parametrize("seed", range(12))
def test_the_way_from_the_front_goes_into_the_mouth(seed: int) -> None:
    trap = _drawer(seed).shallow(6)
    assert trap.front is not None
    assert trap.behind is not None
    front, behind = cell_centres(np.array([trap.front, trap.behind]), SIZE)
    into = (behind - front) / np.linalg.norm(behind - front)
    # What of the outline is met last on the way through is the back.
    along = (trap.outline.reshape(-1, 2) - front) @ into
    back = trap.outline.mean(axis=1)[np.argmax(trap.outline.mean(axis=1) @ into)]
    assert np.isclose(np.linalg.norm(behind - front), 2 * PITCH)
    assert np.isclose((back - front) @ into, along.max())
    across = np.array([-into[1], into[0]])
    assert abs((back - front) @ across) < 1e-9


def test_a_square_is_crossed_from_one_row_into_the_other() -> None:
    for seed in range(20):
        trap = _drawer(seed).in_square(SQUARE, may_be_deep=True)
        assert trap.front is not None
        assert trap.behind is not None
        front, behind = cell_centres(np.array([trap.front, trap.behind]), SIZE)
        np.testing.assert_allclose((front + behind) / 2, [0.0, 0.0], atol=1e-12)
        assert sorted(np.abs(behind - front)) == pytest.approx([PITCH, 3 * PITCH])


def test_there_is_nothing_in_front_where_a_wall_stands_or_the_town_ends() -> None:
    alone = ObstacleDrawer(np.random.default_rng(0), SIZE, np.zeros((0, 2), dtype=np.int64))
    assert alone.deep([]) is None
    trap = alone.shallow(5)
    assert trap.front is None
    assert trap.behind is None
    corners = [_drawer(seed).shallow(0) for seed in range(8)]
    assert all((trap.front is None) != (trap.behind is None) for trap in corners)


@pytest.mark.parametrize("seed", range(12))
def test_pillars_are_squares_within_their_cell(seed: int) -> None:
    pillar = _drawer(seed).pillar(6)
    sides = np.linalg.norm(pillar.outline[:, 1] - pillar.outline[:, 0], axis=1)
    np.testing.assert_allclose(sides, sides[0])
    away = np.linalg.norm(pillar.outline[:, 0] - cell_centres(np.array(6), SIZE), axis=1)
    np.testing.assert_allclose(away, sides[0] / np.sqrt(2.0))
    assert PILLAR[0] <= away[0] <= PILLAR[1]
    assert pillar.front is not None
    assert pillar.behind is not None


@pytest.mark.parametrize("seed", range(30))
def test_pillars_beside_traps_let_robots_through_and_stay_in_the_square(seed: int) -> None:
    drawer = _drawer(seed)
    trap = drawer.in_square(SQUARE, may_be_deep=True)
    pillars = drawer.pillars_beside(trap)
    assert 1 <= len(pillars) <= 2
    for pillar in pillars:
        assert np.abs(pillar.outline).max() <= PITCH - THICKNESS + 1e-9
        assert wall_distances(pillar.outline[:, 0], trap.outline).min() >= PILLAR_GAP[0] - 1e-9
        assert pillar.cells == trap.cells


def test_pillars_stand_on_one_side_or_on_both() -> None:
    numbers, sides = set(), set()
    for seed in range(30):
        drawer = _drawer(seed)
        trap = drawer.in_square(SQUARE, may_be_deep=False)
        angle = 0.5 * np.pi * trap.opens
        across = np.array([-np.sin(angle), np.cos(angle)])
        found = [
            float(np.sign(each.outline.mean(axis=(0, 1)) @ across))
            for each in drawer.pillars_beside(trap)
        ]
        numbers.add(len(found))
        sides |= set(found)
        assert len(set(found)) == len(found)
    assert numbers == {1, 2}
    assert sides == {-1.0, 1.0}

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.fleet import RADIUS
from envs.scenarios.town_avenues import HALF_WIDTH
from envs.scenarios.town_cells import PITCH
from envs.scenarios.town_map import THICKNESS, TownMap, town_map
from envs.scenarios.town_obstacles import DEEP, Trap
from envs.scenarios.town_obstacles import THICKNESS as TRAP_THICKNESS
from envs.scenarios.wall_kernel import wall_distances
from safefilter.lidar import Lidar

numbers = st.integers(0, 10**6)


def drawn(number: int, size: int = 5, *, has_deep_traps: bool = True) -> TownMap:
    return town_map(number, size, has_deep_traps=has_deep_traps)


@settings(deadline=None, max_examples=30)
@given(numbers, st.integers(2, 8))
def test_every_street_is_within_reach_of_every_other(number: int, size: int) -> None:
    town = drawn(number, size)
    assert np.isfinite(town.hops[np.ix_(town.streets, town.streets)]).all()


@settings(deadline=None, max_examples=30)
@given(numbers)
def test_streets_have_room_around_their_middle(number: int) -> None:
    town = drawn(number)
    clear = wall_distances(town.centres[town.streets], town.walls)
    room = HALF_WIDTH[0] if town.has_avenues else (PITCH - THICKNESS) / 2
    assert clear.min() >= room - 1e-9


@settings(deadline=None, max_examples=30)
@given(numbers)
def test_ways_go_from_cell_to_cell_beside_it(number: int) -> None:
    town = drawn(number)
    first, last = town.streets[0], town.streets[-1]
    way = town.way(int(first), int(last))
    assert (way[0], way[-1]) == (first, last)
    assert len(way) - 1 == town.hops[first, last]
    steps = np.linalg.norm(np.diff(town.centres[way], axis=0), axis=1)
    np.testing.assert_allclose(steps, PITCH)


@settings(deadline=None, max_examples=30)
@given(numbers)
def test_no_way_leads_through_a_wall(number: int) -> None:
    # Obstacles stand on ways, and are got round.
    town = drawn(number, has_deep_traps=False)
    walls = town.walls[: len(town.walls) - sum(len(each.outline) for each in town.obstacles)]
    middle = town.centres[np.argwhere(town.hops == 1)].mean(axis=1)
    assert wall_distances(middle, walls).min() >= min(HALF_WIDTH[0], (PITCH - THICKNESS) / 2) - 1e-9


def test_the_same_numbers_give_the_same_map_and_others_another() -> None:
    again = town_map.__wrapped__(3, 5, has_deep_traps=True)
    np.testing.assert_array_equal(drawn(3).walls, again.walls)
    maps = {drawn(number).walls.tobytes() for number in range(50)}
    assert len(maps) == 50


def test_maps_range_from_mazes_to_nets_of_streets() -> None:
    degree = [(drawn(number).hops == 1).sum() / 25 for number in range(60)]
    # A tree of 25 cells has 48 ends of open sides, and a net without walls 80.
    assert min(degree) < 2.2
    assert max(degree) > 2.8


def test_obstacles_and_blocks_appear_and_leave_most_streets_free() -> None:
    taken = [25 - len(town.streets) for town in map(drawn, range(60)) if not town.has_avenues]
    assert min(taken) >= 1
    assert 3 <= np.mean(taken) <= 25 * 0.4
    assert max(taken) <= 25 * 0.5


@pytest.mark.parametrize("has_deep_traps", [False, True])
def test_deep_traps_come_where_they_are_asked_for(*, has_deep_traps: bool) -> None:
    for number in range(20):
        town = drawn(number, has_deep_traps=has_deep_traps)
        if town.has_avenues:
            assert not town.obstacles
            continue
        in_streets = [trap.depth for trap in town.traps if len(trap.cells) < 4]
        assert (max(in_streets, default=0.0) >= DEEP[0]) == has_deep_traps
        assert max((trap.depth for trap in town.traps), default=0.0) <= DEEP[1]


def test_many_maps_have_a_square_with_a_trap_and_pillars() -> None:
    towns = [town for town in map(drawn, range(150)) if not town.has_avenues]
    squares = [[trap for trap in town.traps if len(trap.cells) == 4] for town in towns]
    assert max(map(len, squares)) == 1
    assert 0.65 <= sum(map(len, squares)) / len(towns) <= 0.95
    beside = [
        [each for each in town.obstacles if len(each.cells) == 4 and not isinstance(each, Trap)]
        for town in towns
    ]
    assert all(
        len(pillars) in {1, 2} if traps else not pillars
        for pillars, traps in zip(beside, squares, strict=True)
    )


def test_some_maps_have_avenues_and_streets_enough() -> None:
    share = np.mean([drawn(number).has_avenues for number in range(200)])
    assert 0.4 <= share <= 0.6
    for number in range(40):
        town = town_map(number, 6, has_deep_traps=True, least_streets=20)
        assert len(town.streets) >= 20 or not town.has_avenues
    assert not any(drawn(number, size=2).has_avenues for number in range(40))


@settings(deadline=None, max_examples=30)
@given(numbers)
def test_trips_past_obstacles_have_one_on_their_straight_way(number: int) -> None:
    town = drawn(number)
    for front, behind in [*town.obstructed, *town.across_square]:
        start, goal = town.centres[front], town.centres[behind]
        way = start + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * (goal - start)
        assert (
            wall_distances(way, np.concatenate([each.outline for each in town.obstacles])).min()
            < 0.02
        )
        assert town.is_street[[front, behind]].all()


def test_walls_are_thick_enough_for_a_lidar_alone() -> None:
    needed = Lidar.scan(np.full((1, 360), 3.5)).least_thickness(3.5)
    assert min(THICKNESS, TRAP_THICKNESS) >= needed
    for number in range(20):
        walls = drawn(number).walls
        assert np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1).min() >= needed


def test_robots_fit_past_obstacles_in_streets() -> None:
    for number in range(20):
        town = drawn(number)
        for trap in (each for each in town.obstacles if len(each.cells) < 4):
            for cell in trap.cells:
                # The ring around a trap, beside the walls of its cells: outer corners of a square.
                outwards = town.centres[cell] - town.centres[list(trap.cells)].mean(axis=0)
                corner = np.where(outwards < 0.0, -1.0, 1.0) * (
                    (PITCH - THICKNESS) / 2 - RADIUS - 0.04
                )
                place = town.centres[cell] + corner
                assert wall_distances(place[np.newaxis], town.walls)[0] >= RADIUS

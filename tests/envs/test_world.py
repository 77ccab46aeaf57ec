import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.fleet import Fleet
from envs.world import World, full_speed
from safefilter.errors import ShapeError

# Parts of a direction.
PARTS = st.one_of(st.just(0.0), st.floats(1e-6, 1e6), st.floats(-1e6, -1e-6))


def test_snapshot_keeps_its_moment() -> None:
    world = World.empty(2, Fleet.of(3))
    before = world.snapshot()
    world.position[...] = 7.0
    world.arrived[0, 1] = True
    assert (before.position == 0.0).all()
    assert not before.arrived.any()


def test_robots_are_under_way_until_they_arrive_or_collide() -> None:
    world = World.empty(1, Fleet.of(4))
    assert not world.active.any()
    world.present[...] = True
    world.arrived[0, 1] = True
    world.collided[0, 2] = True
    assert world.active.tolist() == [[True, False, False, True]]


def test_preferred_velocity_points_to_the_goal_at_full_speed() -> None:
    world = World.empty(1, Fleet.of(2, v_max=[0.5, 1.0]))
    world.goal[0] = [[3.0, 4.0], [0.0, -2.0]]
    np.testing.assert_allclose(world.preferred_velocity(), [[[0.3, 0.4], [0.0, -1.0]]], atol=1e-16)


def test_no_direction_means_no_speed() -> None:
    np.testing.assert_array_equal(full_speed(np.zeros((2, 2)), np.ones(2)), np.zeros((2, 2)))


@given(st.lists(st.tuples(PARTS, PARTS, st.floats(0.1, 10.0)), min_size=1, max_size=6))
def test_speed_is_kept_and_so_is_the_direction(drawn: list[tuple[float, float, float]]) -> None:
    numbers = np.array(drawn)
    direction, speed = numbers[:, :2], numbers[:, 2]
    found = full_speed(direction, speed)
    length = np.linalg.norm(direction, axis=1)
    expected = np.where(length > 0.0, speed, 0.0)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), expected, rtol=1e-12)
    # Along the direction: where that points nowhere, both sides are zero.
    along = (found * direction).sum(axis=1)
    np.testing.assert_allclose(along, length * expected, rtol=1e-12)


def test_arrays_of_many_worlds_are_laid_out_as_those_of_one() -> None:
    # Otherwise numba compiles every kernel twice.
    for num_worlds in (1, 3):
        state = World.empty(num_worlds, Fleet.of(4)).state
        assert {name for name, array in state.items() if not array.flags.c_contiguous} == set()


def test_one_speed_a_direction() -> None:
    with pytest.raises(ShapeError, match=r"speed: expected shape \(3,\), got \(2,\)"):
        full_speed(np.ones((3, 2)), np.ones(2))


@given(st.lists(st.tuples(PARTS, PARTS, st.floats(0.1, 10.0)), min_size=1, max_size=6))
def test_the_preferred_velocity_is_full_speed_along_the_way(
    drawn: list[tuple[float, float, float]],
) -> None:
    numbers = np.array(drawn)
    world = World.empty(1, Fleet.of(len(numbers), v_max=numbers[:, 2]))
    world.position[0] = 0.25
    world.goal[0] = numbers[:, :2]
    expected = full_speed(world.goal - world.position, world.v_max)
    np.testing.assert_array_equal(world.preferred_velocity(), expected)

"""Scenes hold what was given, refuse what makes no sense, and cannot be altered."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.errors import InvalidInput, NotFinite, OutOfRange, ShapeError
from safefilter.lidar import Lidar
from safefilter.outlines import OwnWalls
from safefilter.scene import Scene
from safefilter.usable_state import MAX_COORDINATE, MAX_PRIORITY, MIN_PRIORITY

GIVEN: dict[str, Any] = {
    "position": [[0.0, 1.0], [2.0, 3.0], [9.0, 9.0]],
    "velocity": [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]],
    "radius": [0.1, 0.2, 0.3],
}
ALL: dict[str, Any] = {
    **GIVEN,
    "heading": [0.0, 1.0, -2.0],
    "priority": [1.0, 2.0, 3.0],
    "cooperative": [True, False, True],
    "wanted": [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]],
    "world": [0, 0, 7],
}


def scene(**changes: Any) -> Scene:  # wrong values are the point
    return Scene.from_world(**{**GIVEN, **changes})


def test_everything_given_can_be_read_back() -> None:
    made = scene(**ALL)
    for field in ("position", "velocity", "radius", "priority", "heading", "cooperative", "world"):
        np.testing.assert_array_equal(getattr(made, field), ALL[field])
    assert made.wanted is not None
    np.testing.assert_array_equal(made.wanted, ALL["wanted"])
    assert made.num_robots == 3


def test_what_is_not_given_has_its_default() -> None:
    made = scene()
    assert made.priority.tolist() == [1.0] * 3
    assert made.cooperative.tolist() == [True] * 3
    assert made.world.tolist() == [0] * 3
    assert made.wanted is None
    assert made.heading is None
    assert made.reach == math.inf


def test_one_value_is_everyones() -> None:
    made = scene(radius=0.5, priority=2, cooperative=False, world=4, heading=1.5)
    assert made.radius.tolist() == [0.5] * 3
    assert made.priority.tolist() == [2.0] * 3
    assert made.cooperative.tolist() == [False] * 3
    assert made.world.tolist() == [4] * 3
    assert made.heading is not None
    assert made.heading.tolist() == [1.5] * 3


@pytest.mark.parametrize("num_robots", [0, 1])
def test_nobody_and_a_single_robot_are_scenes(num_robots: int) -> None:
    made = Scene.from_world(np.zeros((num_robots, 2)), np.zeros((num_robots, 2)), 0.1)
    assert made.num_robots == num_robots
    assert made.most_neighbours == 0
    assert all(len(made.neighbours_of(robot)) == 0 for robot in range(num_robots))


def test_robots_see_those_within_reach_of_their_world() -> None:
    position = [[0.0, 0.0], [1.0, 0.0], [2.5, 0.0], [0.5, 0.0]]
    made = scene(
        position=position, velocity=np.zeros((4, 2)), radius=0.1, world=[0, 0, 0, 1], reach=1.5
    )
    seen = [sorted(made.neighbours_of(robot).tolist()) for robot in range(4)]
    assert seen == [[1], [0, 2], [1], []]
    assert made.most_neighbours == 2
    assert made.reach == 1.5


@given(num_robots=st.integers(0, 60), seed=st.integers(0, 99))
def test_longest_list_is_known(num_robots: int, seed: int) -> None:
    position = np.random.default_rng(seed).uniform(0.0, 5.0, (num_robots, 2))
    made = Scene.from_world(position, np.zeros((num_robots, 2)), 0.1, reach=1.0)
    lengths = [len(made.neighbours_of(robot)) for robot in range(num_robots)]
    assert made.most_neighbours == max(lengths, default=0)
    assert sum(lengths) == len(made.neighbours)


def test_the_largest_and_smallest_values_are_taken() -> None:
    made = scene(
        position=np.full((3, 2), MAX_COORDINATE),
        priority=[MIN_PRIORITY, 1.0, MAX_PRIORITY],
        radius=5e-324,
    )
    assert made.position.max() == MAX_COORDINATE


def test_later_changes_of_the_arrays_do_not_leak_in() -> None:
    arrays = {name: np.array(value) for name, value in ALL.items()}
    made = scene(**arrays)
    for array in arrays.values():
        assert array.flags.writeable
        array[:] = 1
    for field in ("position", "velocity", "radius", "priority", "heading", "cooperative", "world"):
        np.testing.assert_array_equal(getattr(made, field), ALL[field])


@pytest.mark.parametrize(
    "field",
    [
        *(
            "position",
            "velocity",
            "radius",
            "priority",
            "heading",
            "cooperative",
            "wanted",
            "world",
        ),
        *("state", "neighbours", "neighbour_start"),
    ],
)
def test_scenes_cannot_be_altered(field: str) -> None:
    made = scene(**ALL)
    with pytest.raises(ValueError, match="read-only"):
        getattr(made, field)[0] = 1
    # Python reports a write to a property of a frozen record with slots as a TypeError.
    with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
        setattr(made, field, np.zeros(3))
    with pytest.raises(ValueError, match="read-only"):
        made.neighbours_of(0)[:] = 1


def test_unknown_wants_are_taken_from_what_is_seen() -> None:
    made = scene()
    assert not made.has_wanted
    np.testing.assert_array_equal(made.state[:, 4:6], GIVEN["velocity"])


def crowd(reach: float = 2.0) -> Scene:
    rng = np.random.default_rng(0)
    return Scene.from_world(
        rng.normal(size=(9, 2)),
        rng.normal(size=(9, 2)),
        0.1,
        heading=rng.normal(size=9),
        cooperative=rng.random(9) < 0.5,
        world=rng.integers(0, 2, 9),
        reach=reach,
        walls=rng.normal(size=(3, 2, 2)),
        own_walls=OwnWalls.of(rng.normal(size=(4, 2, 2)), [[0, k % 5] for k in range(9)]),
    )


def test_kernels_are_handed_the_fields() -> None:
    made = crowd()
    for name, part in made.arrays._asdict().items():
        assert part is getattr(made, name)
    assert tuple(made.arrays) == made.parts
    assert len(Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1).arrays.heading) == 0


def test_a_scene_with_another_field_hands_that_to_kernels() -> None:
    made = crowd()
    state = made.state + 1.0
    other = dataclasses.replace(made, state=state)
    assert other.arrays.state is other.state is state
    assert other.arrays.walls is made.walls


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda made: pickle.loads(pickle.dumps(made))])
def test_copies_hand_their_own_fields_to_kernels(copied: Callable[[Scene], Scene]) -> None:
    other = copied(crowd())
    for name, part in other.arrays._asdict().items():
        assert part is getattr(other, name)


def test_a_state_laid_out_makes_the_same_scene() -> None:
    made = crowd()
    assert made.heading is not None
    own = OwnWalls(made.walls[3:], made.wall_range - 3, int(np.ptp(made.wall_range, axis=1).max()))
    state = made.state.copy()
    other = Scene.of_state(
        state,
        heading=made.heading.copy(),
        cooperative=made.cooperative.copy(),
        has_wanted=False,
        world=made.world.copy(),
        reach=made.reach,
        known=made.walls[:3],
        own_walls=own,
    )
    for name, part in made.arrays._asdict().items():
        np.testing.assert_array_equal(getattr(other, name), part)
    # Taken over, and nobody writes to it any more.
    assert other.state is state
    assert not state.flags.writeable


LAID_OUT: dict[str, Any] = {
    "state": np.ones((2, 8)),
    "heading": np.zeros(2),
    "cooperative": np.ones(2, dtype=np.bool_),
    "has_wanted": False,
    "world": np.zeros(2, dtype=np.int64),
    "reach": np.inf,
}


def laid_out(**changes: Any) -> dict[str, Any]:
    return {**copy.deepcopy(LAID_OUT), **changes}


@pytest.mark.parametrize("field", ["state", "heading"])
def test_numbers_of_a_state_laid_out_are_checked(field: str) -> None:
    wrong = laid_out()
    wrong[field][1] = np.nan
    with pytest.raises(NotFinite, match=r"^(position|heading) of row 1: expected a finite number"):
        Scene.of_state(**wrong)


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("state", np.ones((2, 7))),
        ("state", np.ones(8)),
        ("state", np.ones((2, 8), dtype=np.float32)),
        ("heading", np.zeros(1)),
        ("heading", np.zeros(3)),
        ("cooperative", np.ones(1, dtype=np.bool_)),
        ("cooperative", np.ones(2)),
        ("world", np.zeros(1, dtype=np.int64)),
        ("world", np.zeros(2)),
    ],
)
def test_shapes_of_a_state_laid_out_are_checked(field: str, wrong: Any) -> None:
    with pytest.raises(ShapeError, match=f"^{field}: expected "):
        Scene.of_state(**laid_out(**{field: wrong}))


@pytest.mark.parametrize("reach", [np.nan, 0.0, -1.0])
def test_a_reach_that_is_none_is_refused(reach: float) -> None:
    with pytest.raises(OutOfRange, match=r"^reach: expected a distance above 0 m, got "):
        Scene.of_state(**laid_out(reach=reach))


@pytest.mark.parametrize(
    ("field", "given_to_it"),
    [
        ("heading", {"heading": np.zeros(2)}),
        ("walls", {"known": np.zeros((1, 5))}),
        ("own_walls", {"own_walls": OwnWalls.none(2)}),
        ("lidar", {"lidar": Lidar.scan(np.full((2, 36), np.inf))}),
    ],
)
def test_a_state_in_space_has_none_of_what_the_plane_has(
    field: str, given_to_it: dict[str, Any]
) -> None:
    wrong = laid_out(state=np.ones((2, 11)), heading=None)
    with pytest.raises(InvalidInput, match=f"^{field}: robots in space have none"):
        Scene.of_state(**{**wrong, **given_to_it})

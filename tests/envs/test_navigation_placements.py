"""What a placement may say of a world: walls, headings, speeds and priorities of its own."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from envs import Fleet, Navigation
from envs.scenarios import Placement, Scenario
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, OutOfRange, ShapeError


def drives(scenario: Scenario, num_worlds: int = 1) -> Navigation:
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    navigation = Navigation(scenario, fleet, num_worlds=num_worlds)
    navigation.reset(0)
    return navigation


@dataclass(frozen=True)
class Rooms:
    """One robot; walls, headings, speeds and priorities that differ from world to world."""

    num_robots: int = 1
    half_extent: float = 9.0
    name: str = "rooms"

    def place(self, rng: np.random.Generator) -> Placement:
        size = rng.integers(1, 4)
        walls = rng.uniform(2.0, 5.0, (size, 2, 2))
        start, goal = np.zeros((1, 2)), np.ones((1, 2))
        own = np.full(1, 0.1 * size)
        return Placement(start, goal, walls, heading=own, v_max=own, priority=own)


def test_each_world_has_walls_headings_speeds_and_priorities_of_its_own() -> None:
    navigation = drives(Rooms(), num_worlds=12)
    world = navigation.world
    sizes = np.array([len(world.walls_of(w)) for w in range(12)])
    assert set(sizes.tolist()) == {1, 2, 3}
    for array in (world.heading, world.v_max, world.priority):
        np.testing.assert_allclose(array[:, 0], 0.1 * sizes)
    scene = navigation.scenes()
    np.testing.assert_array_equal(scene.wall_range[:, 1] - scene.wall_range[:, 0], sizes)
    for w in range(12):
        known = scene.walls[slice(*scene.wall_range[w]), :4]
        np.testing.assert_array_equal(known.reshape(-1, 2, 2), world.walls_of(w))
    before = scene.walls.copy()
    navigation.reset(99)
    np.testing.assert_array_equal(scene.walls, before)


@dataclass(frozen=True)
class Placed:
    """One robot, placed as it is said."""

    placement: Placement
    num_robots: int = 1
    half_extent: float = 9.0
    name: str = "placed"

    def place(self, rng: np.random.Generator) -> Placement:
        del rng
        return self.placement


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"start": np.zeros((2, 2))}, ShapeError, r"start of world 0: expected shape \(1, 2\)"),
        ({"goal": np.full((1, 2), np.nan)}, NotFinite, "goal of world 0 of row 0"),
        ({"heading": np.zeros(3)}, ShapeError, r"heading of world 0: expected shape \(1,\)"),
        ({"v_max": np.zeros(1)}, OutOfRange, "v_max of world 0 of row 0: expected a number above"),
        ({"walls": np.zeros((1, 4))}, ShapeError, "walls of world 0: expected shape"),
    ],
)
def test_placements_that_cannot_be_used_are_refused(
    changed: dict[str, FloatArray], error: type[Exception], message: str
) -> None:
    placement = replace(Placement(np.zeros((1, 2)), np.ones((1, 2))), **changed)
    with pytest.raises(error, match=message):
        drives(Placed(placement))

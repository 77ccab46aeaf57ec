"""The state of worlds is laid out for scenes as `Scene.from_world` lays it out."""

from __future__ import annotations

import numpy as np
import pytest

from envs.fleet import Fleet
from envs.scene_state import scene_state
from envs.sensing import SensedArrays
from envs.world import World
from safefilter.scene import Scene

NUM_WORLDS, NUM_ROBOTS = 3, 4


@pytest.fixture
def world() -> World:
    rng = np.random.default_rng(0)
    fleet = Fleet.of(NUM_ROBOTS, radius=[0.1, 0.2, 0.3, 0.4], priority=[1.0, 2.0, 3.0, 4.0])
    world = World.empty(NUM_WORLDS, fleet)
    for array in (world.position, world.velocity):
        array[...] = rng.normal(size=array.shape)
    return world


@pytest.mark.parametrize("worlds", [slice(None), slice(1, 2), slice(3, 3)])
@pytest.mark.parametrize("tells", [False, True])
def test_it_is_the_state_of_the_scene_of_these_robots(
    world: World, worlds: slice, tells: bool
) -> None:
    # Others see it a little aside of where it is.
    known = SensedArrays(world.position + 0.01, world.velocity - 0.01, world.heading)
    told = np.random.default_rng(1).normal(size=world.velocity.shape) if tells else None
    expected = Scene.from_world(
        known.position[worlds].reshape(-1, 2),
        known.velocity[worlds].reshape(-1, 2),
        world.radius[worlds].ravel(),
        priority=world.priority[worlds].ravel(),
        wanted=None if told is None else told[worlds].reshape(-1, 2),
    )
    state = scene_state(world, known, worlds, told)
    np.testing.assert_array_equal(state, expected.state)
    for array in (world.position, world.velocity, world.radius, world.priority):
        assert not np.shares_memory(state, array)

"""Shortest ways of robots: around walls, from world to world, and anew after a reset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs import Circle, Crossroad, Fleet, Navigation
from envs.fleet import RADIUS
from envs.reward import RewardWeights
from envs.reward_tracker import RewardTracker
from envs.scenarios import Town, load_scenario
from envs.scenarios.scenario import Placement
from envs.scenarios.ways import shortest_ways
from envs.shortest_ways import ShortestWays
from envs.world import World
from safefilter.arrays import FloatArray


class BehindAWall:
    """Two robots with a wall 2 m long between them and their goals."""

    num_robots = 2
    half_extent = 2.0
    name = "wall"

    def place(self, rng: np.random.Generator) -> Placement:
        y = rng.uniform(-0.1, 0.1)
        return Placement(
            start=np.array([[-0.5, y], [0.5, y]]),
            goal=np.array([[0.5, 0.0], [-0.5, 0.0]]),
            walls=np.array([[[0.0, -1.0], [0.0, 1.0]]]),
        )


@dataclass(frozen=True)
class Placed:
    """One placement, always the same."""

    placement: Placement
    num_robots: int = 8
    half_extent: float = 4.0
    name: str = "placed"

    def place(self, rng: np.random.Generator) -> Placement:  # noqa: ARG002
        return self.placement


def lengths(ways: ShortestWays, world: World) -> FloatArray:
    ways.renew(world)
    return ways.lengths(world, world.position)


def test_the_way_leads_round_the_wall() -> None:
    navigation = Navigation(BehindAWall(), num_worlds=2)
    navigation.reset(0)
    found = lengths(ShortestWays(), navigation.world)
    # By its end, a radius away from it.
    around = 2.0 * np.hypot(0.5, 1.0 + navigation.world.radius)
    np.testing.assert_allclose(found, around, rtol=0.12)


def test_without_walls_it_is_straight() -> None:
    navigation = Navigation(Circle(6))
    navigation.reset(0)
    world = navigation.world
    away = np.hypot(*np.moveaxis(world.goal - world.position, -1, 0))
    found = lengths(ShortestWays(), world)
    assert (found >= away - 1e-6).all()
    assert (found <= 1.05 * away).all()


def test_at_the_goal_nothing_is_left_and_next_to_it_the_straight_way() -> None:
    navigation = Navigation(Crossroad(is_walled=True))
    navigation.reset(0)
    world, ways = navigation.world, ShortestWays()
    ways.renew(world)
    assert ways.lengths(world, world.goal) == pytest.approx(0.0)
    aside = world.goal + np.array([0.03, -0.04])
    assert ways.lengths(world, aside) == pytest.approx(0.05)


def test_worlds_that_are_reset_are_looked_at_again_and_no_others() -> None:
    navigation = Navigation(Town(4), Fleet.of(4, kinematics="differential"), num_worlds=3)
    navigation.reset(1)
    world, ways = navigation.world, ShortestWays()
    before = lengths(ways, world)
    for _ in range(3):
        navigation.step(np.zeros((3, 4, 2)))
    navigation.reset(worlds=[False, True, False])
    after = lengths(ways, world)
    np.testing.assert_array_equal(after[[0, 2]], before[[0, 2]])
    assert (after[1] != before[1]).any()
    np.testing.assert_array_equal(after, lengths(ShortestWays(), world))


def test_every_goal_of_a_town_is_within_reach() -> None:
    navigation = Navigation(Town(8), Fleet.of(8, kinematics="differential"), num_worlds=40)
    navigation.reset(3)
    world = navigation.world
    away = np.hypot(*np.moveaxis(world.goal - world.position, -1, 0))
    found = lengths(ShortestWays(), world)
    assert np.isfinite(found).all()
    assert (found >= away - 1e-6).all()
    # Mazes: somebody has to go far.
    assert (found > 2.0 * away).any()


def test_lengths_agree_with_those_of_a_graph() -> None:
    # Independent of this: steps along and across the cells of a fine grid, up to 8 % too long.
    for seed in range(4):
        placement = Town(8).place(np.random.default_rng(seed))
        navigation = Navigation(Placed(placement), Fleet.of(8, kinematics="differential"))
        navigation.reset(0)
        found = lengths(ShortestWays(), navigation.world)[0]
        np.testing.assert_allclose(found, shortest_ways(placement, RADIUS), rtol=0.12)


@given(middle=st.floats(-0.5, 0.5), angle=st.floats(0.0, np.pi))
@settings(max_examples=40, deadline=None)
def test_a_wide_gap_is_open_and_a_narrow_one_is_shut_wherever_it_is(
    middle: float, angle: float
) -> None:
    for gap, is_open in ((0.32, True), (0.14, False)):
        ends = np.array([[-3.0, -gap / 2.0], [gap / 2.0, 3.0]]) + middle
        turn = np.array([-np.sin(angle), np.cos(angle)])
        walls = ends[..., np.newaxis] * turn
        across = np.array([np.cos(angle), np.sin(angle)])
        start, goal = 0.8 * across + middle * turn, -0.8 * across + middle * turn
        placement = Placement(np.array([start, goal]), np.array([goal, start]), walls)
        navigation = Navigation(Placed(placement, num_robots=2))
        navigation.reset(0)
        found = lengths(ShortestWays(), navigation.world)
        # Round the far end of a wall it would be more than 5 m.
        assert (found < 2.5).all() == is_open


def test_out_of_a_trap_every_step_back_is_progress() -> None:
    navigation = Navigation(load_scenario("deep_traps"), Fleet.of(4, kinematics="differential"))
    navigation.reset(0)
    world, ways = navigation.world, ShortestWays()
    ways.renew(world)
    # From the bottom of the trap 1.2 m deep, at x = 0.6, out to the west and round it.
    path = np.array([[x, 1.0] for x in (0.49, 0.4, 0.2, -0.1, -0.4)])
    found = [ways.lengths(world, np.broadcast_to(place, world.position.shape)) for place in path]
    eastbound = np.flatnonzero(world.goal[0, :, 0] > 1.2)[0]
    assert (np.diff([each[0, eastbound] for each in found]) < 0.0).all()


def test_progress_adds_up_to_the_whole_way() -> None:
    navigation = Navigation(BehindAWall())
    navigation.reset(0)
    world = navigation.world
    tracker = RewardTracker(replace(RewardWeights.sparse(), way=1.0))
    first = lengths(ShortestWays(), world)
    paid = np.zeros((1, 2))
    rng = np.random.default_rng(0)
    for _ in range(20):
        tracker.remember(world)
        outcome = navigation.step(rng.uniform(-0.1, 0.1, (1, 2, 2)))
        paid += tracker.reward(world, outcome).way
    assert paid == pytest.approx(first - lengths(ShortestWays(), world))

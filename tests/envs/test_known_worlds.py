"""What filters know of worlds is decided in as in the scenes that a navigation makes, whatever has become of it."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import safefilter as sf
from envs import Circle, Crossroad, Fleet, Navigation, Rules, Town
from envs.known_worlds import KnownWorlds
from envs.scenarios import load_scenario
from envs.sensing import Sensing
from safefilter.errors import OutOfRange, ShapeError
from safefilter.worlds import Worlds

DT = 0.2
NOISY = Sensing(position_noise=0.01, velocity_noise=0.02, heading_noise=0.1, delay=1, dropout=0.1)


def make_filter(*, is_shared: bool = False) -> sf.SafetyFilter:
    orca = sf.PriorityORCA(2.0, v_opt="shared" if is_shared else "current")
    drive = sf.DifferentialDrive(0.22, 2.5, DT, tracking_error=0.05)
    return sf.SafetyFilter([orca, sf.Separation(DT), sf.StaticObstacles(1.0)], drive)


def make(scenario: Any, rules: Rules | None = None, **settings: Any) -> Navigation:
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    rules = Rules(dt=DT) if rules is None else rules
    navigation = Navigation(scenario, fleet, rules, num_worlds=3, **settings)
    navigation.reset(0)
    return navigation


def wishes(navigation: Navigation, seed: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    rng = np.random.default_rng(seed)
    return rng.uniform([0.0, -2.5], [0.22, 2.5], (*navigation.world.radius.shape, 2))


@pytest.mark.parametrize(
    ("scenario", "settings", "is_shared"),
    [
        (Crossroad(is_walled=True), {}, False),
        (Crossroad(is_walled=True), {}, True),
        (Crossroad(is_walled=True), {"sensing": NOISY}, False),
        (Crossroad(is_walled=True), {"rules": Rules(dt=DT, num_beams=60)}, False),
        (Circle(60), {}, False),
        (load_scenario("corridor_people"), {}, False),
    ],
    ids=["map", "shared", "noisy", "lidar", "large", "people"],
)
def test_decisions_are_those_of_the_scenes(
    scenario: Any, settings: dict[str, Any], is_shared: bool
) -> None:
    navigation, safety = make(scenario, **settings), make_filter(is_shared=is_shared)
    world = navigation.world
    for number in range(12):
        # One after the other vanishes; they are never met again, but may still be decided for.
        world.present[number % 3, number % world.num_robots] &= number < 6
        actions = navigation.wanted(wishes(navigation, number))
        chosen = world.cooperative & (np.arange(world.num_robots) % 2 == 0) if number % 3 else None
        executed, decision = navigation.decide(safety, actions, chosen)
        index = np.flatnonzero(world.cooperative if chosen is None else chosen)
        expected = safety.decide(navigation.scenes(actions), actions.reshape(-1, 2)[index], index)
        for name in ("action", "wanted", "case", "active", "multipliers", "index", "certified"):
            np.testing.assert_array_equal(getattr(decision, name), getattr(expected, name))
        actions.reshape(-1, 2)[index] = decision.action
        np.testing.assert_array_equal(executed, actions, strict=True)
        outcome = navigation.step(executed)
        # People may walk into robots, and noise is not allowed for.
        is_exact = "sensing" not in settings and not world.person.any()
        assert not (is_exact and (outcome.hit_robot.any() or outcome.hit_wall.any()))


def test_other_walls_are_known_at_once() -> None:
    navigation, safety = make(Town(num_robots=6)), make_filter()
    for number in range(6):
        actions = wishes(navigation, number)
        _, decision = navigation.decide(safety, actions)
        expected = safety.decide(
            navigation.scenes(), actions.reshape(-1, 2)[decision.index], decision.index
        )
        np.testing.assert_array_equal(decision.action, expected.action)
        np.testing.assert_array_equal(decision.active, expected.active)
        navigation.reset(number, worlds=np.arange(3) == number % 3)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))])
def test_a_copy_decides_by_its_own_state(copied: Callable[[Navigation], Navigation]) -> None:
    safety = make_filter()
    original = make(Circle(6))
    original.decide(safety, wishes(original, 0))  # so that there is something kept
    navigation = copied(original)
    for number in range(60):
        actions = np.full((3, 6, 2), (0.22, 0.0))
        executed, decision = navigation.decide(safety, actions)
        world = navigation.world
        scene = sf.Scene.from_world(
            world.position.reshape(-1, 2),
            world.velocity.reshape(-1, 2),
            world.radius.ravel(),
            heading=world.heading.ravel(),
            world=np.repeat(np.arange(3), 6),
        )
        expected = safety.decide(scene, actions.reshape(-1, 2))
        np.testing.assert_array_equal(decision.action, expected.action)
        np.testing.assert_array_equal(navigation.scenes().position, scene.position)
        assert not navigation.step(executed).hit_robot.any(), number
    assert (original.world.velocity == 0.0).all()


WAYS = {
    "map": ({}, False),
    "shared": ({}, True),
    "lidar": ({"rules": Rules(dt=DT, num_beams=60)}, False),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("actions", "chosen", "message"),
    [
        (np.zeros((8, 2)), None, "action"),
        (np.zeros((3, 2, 8)), None, "action"),
        ([[0.1, 0.0]], None, "action"),
        (np.zeros((3, 8, 2)), np.ones(8, dtype=bool), "chosen"),
        (np.zeros((3, 8, 2)), np.ones((1, 8), dtype=bool), "chosen"),
        (np.zeros((3, 8, 2)), np.ones((3, 8)), "chosen"),
    ],
)
def test_malformed_wishes_and_choices_are_refused_whoever_decides(
    way: str, actions: Any, chosen: Any, message: str
) -> None:
    settings, is_shared = WAYS[way]
    navigation = make(Crossroad(is_walled=True), **settings)
    with pytest.raises(ShapeError, match=message):
        navigation.decide(make_filter(is_shared=is_shared), actions, chosen)


@pytest.mark.parametrize("way", WAYS)
def test_one_robots_nonsense_stops_nobody_else(way: str) -> None:
    settings, is_shared = WAYS[way]
    navigation = make(Crossroad(is_walled=True), **settings)
    actions = np.full((3, 8, 2), 0.1)
    actions[1, 2, 0] = np.nan
    executed, decision = navigation.decide(make_filter(is_shared=is_shared), actions)
    assert np.isfinite(executed).all()
    assert decision.certified.all()
    assert np.flatnonzero(decision.fault).tolist() == [10]
    assert decision.fault[10] == sf.Fault.ACTION_NOT_FINITE


@pytest.mark.parametrize("number", [-1, 3, 99])
def test_there_is_no_such_world(number: int) -> None:
    with pytest.raises(OutOfRange, match="world: expected 0 to 2"):
        make(Crossroad()).scene(number)


def test_what_is_kept_is_made_anew_when_walls_change() -> None:
    navigation = make(Town(num_robots=6))
    known = KnownWorlds(navigation.world, navigation.observer.sensed.arrays, navigation.rules)
    first = known.of()
    assert known.of() is first
    navigation.reset(99)
    assert known.of() is not first


@pytest.mark.parametrize("number", [0, 2])
def test_one_world_is_known_alone(number: int) -> None:
    navigation = make(Town(num_robots=6))
    known = KnownWorlds(navigation.world, navigation.observer.sensed.arrays, navigation.rules)
    scene = known.of(slice(number, number + 1)).scene()
    np.testing.assert_array_equal(scene.position, navigation.world.position[number])
    walls = navigation.world.walls_of(number).reshape(-1, 4)
    for first, end in scene.wall_range:
        np.testing.assert_array_equal(scene.walls[first:end, :4], walls)


def test_a_kept_one_shares_the_state() -> None:
    navigation = make(Crossroad())
    known = KnownWorlds(navigation.world, navigation.observer.sensed.arrays, navigation.rules).of()
    assert isinstance(known, Worlds)
    assert np.shares_memory(known.kept.record.position, navigation.world.position)

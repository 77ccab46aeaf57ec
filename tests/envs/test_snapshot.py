"""Tests of snapshots: from a restored moment everything goes on bit for bit."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from envs import AfterArrival, Fleet, Navigation, Rules
from envs.observation_layout import ObservationLayout
from envs.reward_tracker import RewardTracker
from envs.scenarios import Scenario, Town, load_scenario
from envs.sensing import Sensing
from envs.snapshot import Snapshot, SnapshotError
from policies.nested_state import put_together, taken_apart

NOISY = Sensing(
    position_noise=0.01,
    velocity_noise=0.01,
    heading_noise=0.02,
    delay=2,
    dropout=0.2,
    lidar_noise=0.01,
    beam_dropout=0.05,
)
LAYOUT = ObservationLayout(has_memory=True)


def made(
    scenario: Scenario,
    num_worlds: int = 4,
    sensing: Sensing = NOISY,
    kinematics: Any = "differential",
) -> Navigation:
    fleet = Fleet.of(scenario.num_robots, kinematics=kinematics)
    rules = Rules(after_arrival=AfterArrival.REBORN, goal_radius=0.4, birth_gap=0.01)
    return Navigation(scenario, fleet, rules, num_worlds=num_worlds, layout=LAYOUT, sensing=sensing)


def town(num_worlds: int = 4, num_robots: int = 8) -> Navigation:
    return made(Town(num_robots, num_maps=12), num_worlds)


def drive(
    navigation: Navigation, tracker: RewardTracker, rng: np.random.Generator, num_steps: int
) -> list[Any]:
    """Drive towards the goals, in curves, with a map change on the way; everything that can be seen of it."""
    world, seen = navigation.world, []
    for step in range(num_steps):
        ahead = world.goal - world.position
        turn = np.arctan2(ahead[..., 1], ahead[..., 0]) - world.heading
        action = np.stack([world.v_max, 4.0 * np.sin(turn) + rng.normal(size=turn.shape)], axis=-1)
        tracker.remember(world)
        outcome = navigation.step(action)
        reward = tracker.reward(world, outcome).total
        if step % 20 == 19:
            navigation.reset(worlds=np.arange(world.num_worlds) == step // 20 % world.num_worlds)
        seen.append((
            outcome.reborn,
            outcome.clearance,
            reward,
            navigation.observe(),
            *_arrays(navigation),
        ))
    return seen


def _arrays(navigation: Navigation) -> list[Any]:
    arrays = navigation.state()["arrays"]
    return [arrays[name] for name in sorted(arrays)]


def assert_same(one: list[Any], other: list[Any]) -> None:
    for step, (first, second) in enumerate(zip(one, other, strict=True)):
        for a, b in zip(first, second, strict=True):
            assert a.tobytes() == b.tobytes(), step


@pytest.mark.parametrize("through_file", [False, True])
def test_town_traffic_goes_on_bit_for_bit(*, through_file: bool) -> None:
    one, tracker = town(), RewardTracker()
    one.reset(3)
    before = drive(one, tracker, np.random.default_rng(0), 130)
    assert any(step[0].any() for step in before), "robots are reborn on the way"
    state, remembered = one.state(), tracker.state()
    if through_file:
        state = put_together(*taken_apart(state))
        remembered = put_together(*taken_apart(remembered))
    expected = drive(one, tracker, np.random.default_rng(1), 50)
    assert any(step[0].any() for step in expected)
    other, other_tracker = town(), RewardTracker()
    other.reset(8)
    drive(other, other_tracker, np.random.default_rng(5), 3)
    other.restore(state)
    other_tracker.restore(remembered)
    assert_same(drive(other, other_tracker, np.random.default_rng(1), 50), expected)


def test_a_navigation_goes_back_to_its_own_past() -> None:
    navigation, tracker = town(2), RewardTracker()
    navigation.reset(0)
    state, remembered = navigation.state(), tracker.state()
    expected = drive(navigation, tracker, np.random.default_rng(1), 30)
    navigation.restore(state)
    tracker.restore(remembered)
    assert_same(drive(navigation, tracker, np.random.default_rng(1), 30), expected)


def test_people_go_on_where_they_were_going() -> None:
    scenario = load_scenario("corridor_people")
    one, other = (made(scenario, 2, Sensing(), "holonomic") for _ in range(2))
    one.reset(1)
    still = np.zeros(one.world.position.shape)
    for _ in range(60):
        one.step(still)
    other.restore(one.state())
    for _ in range(60):
        one.step(still)
        other.step(still)
    np.testing.assert_array_equal(one.world.position, other.world.position)
    assert one.world.person.any()


def test_a_snapshot_is_a_copy() -> None:
    navigation, tracker = town(1), RewardTracker()
    navigation.reset(0)
    state = navigation.state()
    position = state["arrays"]["position"].copy()
    drive(navigation, tracker, np.random.default_rng(1), 3)
    np.testing.assert_array_equal(state["arrays"]["position"], position)
    navigation.restore(state)
    drive(navigation, tracker, np.random.default_rng(1), 3)
    np.testing.assert_array_equal(state["arrays"]["position"], position)


def spoilt(state: Snapshot, **changed: object) -> Snapshot:
    return {**state, **changed}


def test_a_snapshot_that_does_not_fit_changes_nothing() -> None:
    navigation = town(2)
    navigation.reset(0)
    state = navigation.state()
    before = _arrays(navigation)
    generators = state["generators"]
    faults = {
        "expected arrays .*, got NoneType": {},
        "expected arrays .*'gait.direction'.*, got": spoilt(state, arrays={}),
        r"walls: expected float64 of shape \(3, 2, 2\)": spoilt(state, num_walls=np.array([1, 2])),
        "num_walls: expected int64 .*got list": spoilt(state, num_walls=[1, 2]),
        "states of 2 generators": spoilt(state, generators=generators[:1]),
        "no state of a generator": spoilt(state, generators=[{}, {}]),
        "position: .*other worlds, robots or settings": made(Town(4), 2).state(),
        "expected arrays .*'sensed.sent'": made(Town(8), 2, Sensing()).state(),
    }
    for message, fault in faults.items():
        with pytest.raises(SnapshotError, match=message):
            navigation.restore(fault)
        for a, b in zip(_arrays(navigation), before, strict=True):
            assert a.tobytes() == b.tobytes()


@pytest.mark.parametrize("state", [{}, {"course": 3}, {"course": np.zeros((2, 2))}])
def test_a_tracker_refuses_what_is_no_state_of_one(state: Snapshot) -> None:
    with pytest.raises(SnapshotError, match="expected courses of shape"):
        RewardTracker().restore(state)


def test_nothing_that_steps_change_is_left_out() -> None:
    # A new array of the world, the observer or the crowd would be found here: a step in one must not be seen in another
    # that was restored before it.
    one, other = town(2), town(2)
    one.reset(0)
    drive(one, RewardTracker(), np.random.default_rng(0), 25)
    other.reset(9)
    different = _reachable(other)
    other.restore(one.state())
    reached = _reachable(one)
    assert reached == _reachable(other)
    for place in (".world.position", "._generators.1", "._gait.1", ".observer._odometry.arrays.0"):
        assert reached[place] != different[place]


def _reachable(navigation: Navigation) -> dict[str, bytes]:
    """All arrays that hang on a navigation, but walls, which may have more room than they need, what is kept
    as long as they are the same, and working space."""
    found: dict[str, bytes] = {}
    _visit(navigation, "", found, set())
    return found


def _visit(thing: object, place: str, found: dict[str, bytes], seen: set[int]) -> None:
    is_kept = place.rpartition(".")[2] in {"_kept_map", "_kept"}
    if id(thing) in seen or is_kept or place in {".world.walls", "._motion"}:
        return
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        found[place] = thing.tobytes()
    elif isinstance(thing, np.random.Generator):
        found[place] = str(thing.bit_generator.state).encode()
    elif isinstance(thing, list | tuple):
        for k, part in enumerate(thing):
            _visit(part, f"{place}.{k}", found, seen)
    elif type(thing).__module__.startswith("envs."):
        slots = getattr(type(thing), "__slots__", ())
        parts = {name: getattr(thing, name) for name in slots} | getattr(thing, "__dict__", {})
        for name, part in parts.items():
            _visit(part, f"{place}.{name}", found, seen)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda other: pickle.loads(pickle.dumps(other))])
def test_a_copy_of_a_navigation_goes_on_with_arrays_of_its_own(
    copied: Callable[[Navigation], Navigation],
) -> None:
    navigation = made(load_scenario("crossroad"), 2)
    navigation.reset(0)
    drive(navigation, RewardTracker(), np.random.default_rng(0), 3)
    other = copied(navigation)
    before = navigation.world.snapshot()
    left = drive(other, RewardTracker(), np.random.default_rng(1), 5)
    # The first has not moved meanwhile, and moves alike now.
    np.testing.assert_array_equal(navigation.world.position, before.position)
    right = drive(navigation, RewardTracker(), np.random.default_rng(1), 5)
    np.testing.assert_array_equal(other.world.position, navigation.world.position)
    np.testing.assert_array_equal(other.observe(), navigation.observe())
    assert len(left) == len(right)

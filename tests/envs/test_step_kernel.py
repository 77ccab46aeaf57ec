"""What a step does with arrivals, wrecks and those that spin; how it moves is in test_dynamics and test_navigation."""

import resource
import warnings
from dataclasses import dataclass

import numba
import numpy as np
import pytest

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules, World
from envs.crowd import Crowd, Motion
from envs.observation_layout import ObservationLayout, Observations
from envs.rules import AfterArrival as Order
from envs.scenarios import Placement
from envs.sensing import Sensing
from envs.steering import steer
from envs.step_kernel import PARK, REBORN, VANISH, YIELD
from safefilter.arrays import BoolArray


@dataclass(frozen=True)
class Lane:
    """Robots in a row, 1 m apart, that all go 0.5 m north."""

    num_robots: int = 2
    half_extent: float = 9.0
    name: str = "lane"

    def place(self, rng: np.random.Generator) -> Placement:
        del rng
        start = np.zeros((self.num_robots, 2))
        start[:, 0] = np.arange(self.num_robots)
        return Placement(start, start + np.array([0.0, 0.5]))


def started(rules: Rules, kinematics: str = "holonomic", num_robots: int = 2) -> Navigation:
    fleet = Fleet.of(num_robots, kinematics=kinematics)  # type: ignore[arg-type]  # one of two
    navigation = Navigation(Lane(num_robots), fleet, rules)
    navigation.reset(0)
    return navigation


def test_rules_have_the_numbers_that_kernels_know() -> None:
    order = {YIELD: Order.YIELD, PARK: Order.PARK, VANISH: Order.VANISH, REBORN: Order.REBORN}
    assert [order[number] for number in sorted(order)] == list(AfterArrival)


def test_a_reborn_robot_starts_anew_and_its_cycles_are_counted() -> None:
    navigation = started(Rules(after_arrival=AfterArrival.REBORN))
    world, cycles = navigation.world, []
    start = world.position.copy()
    for _ in range(60):
        outcome = navigation.step(world.preferred_velocity())
        assert (outcome.reborn == outcome.arrived).all()
        cycles += outcome.cycle_time[outcome.arrived].tolist()
        np.testing.assert_array_equal(world.position[outcome.reborn], start[outcome.reborn])
        assert not outcome.over.any()
    # 0.38 m to the edge of the goal at 0.2 m/s: ten steps of 0.04 m.
    np.testing.assert_allclose(cycles, 2.0)
    assert world.arrivals.tolist() == [[6, 6]]
    np.testing.assert_allclose(world.arrival_time, 2.0)
    assert world.cooperative.all()


def test_a_robot_waits_at_its_goal_until_its_start_is_free() -> None:
    navigation = started(Rules(after_arrival=AfterArrival.REBORN))
    world = navigation.world
    # Robot 1 stands on the start of robot 0, which is just arriving.
    world.position[0] = [[0.0, 0.37], [0.0, 0.0]]
    forward = np.array([[[0.0, 0.1], [0.0, 0.0]]])
    outcome = navigation.step(forward)
    assert outcome.arrived.tolist() == [[True, False]]
    for _ in range(3):
        assert not outcome.reborn.any()
        assert not outcome.over.any()
        assert world.position[0, 0, 1] == pytest.approx(0.39)
        assert not world.cooperative[0, 0]
        outcome = navigation.step(forward)
    world.position[0, 1] = [5.0, 0.0]
    outcome = navigation.step(forward)
    assert outcome.reborn.tolist() == [[True, False]]
    assert world.cooperative[0, 0]
    assert world.arrivals.tolist() == [[1, 0]]


@pytest.mark.stress
def test_nobody_is_ever_reborn_into_another() -> None:
    rules = Rules(after_arrival=AfterArrival.REBORN, time_limit=1e6)
    navigation = Navigation(Crossroad(), Fleet.of(8), rules, num_worlds=20)
    navigation.reset(0)
    world, rng = navigation.world, np.random.default_rng(0)
    reborn = 0
    for _ in range(400):
        # Goals near, and in disorder: starts are often taken.
        outcome = navigation.step(rng.normal(0.0, 0.2, world.position.shape))
        for w, i in np.argwhere(outcome.reborn):
            away = np.linalg.norm(world.position[w] - world.position[w, i], axis=-1)
            away[i] = np.inf
            assert away.min() >= 2 * 0.105 + rules.birth_gap
            reborn += 1
        near = rng.uniform(size=world.arrived.shape) < 0.1
        world.goal[near] = world.position[near]
    assert reborn > 50


def test_wrecks_vanish_if_they_are_told_to() -> None:
    for vanish in (False, True):
        navigation = started(Rules(wrecks_vanish=vanish))
        navigation.world.position[0, 1] = [0.3, 0.0]
        outcome = navigation.step(np.array([[[0.2, 0.0], [-0.2, 0.0]]] * 1))
        while not outcome.collided.any():
            outcome = navigation.step(np.array([[[0.2, 0.0], [-0.2, 0.0]]]))
        assert (navigation.world.present == (not vanish)).all()
        assert navigation.world.collided.all()


def spinning(v: float, w: float, *, flips: bool = False) -> BoolArray:
    """Whether robots have rotated in place at the time limit of 20 s; robot 1 stands still."""
    navigation = started(Rules(time_limit=20.0), "differential")
    for step in range(100):
        sign = -1.0 if flips and step % 2 else 1.0
        outcome = navigation.step(np.array([[[v, sign * w], [0.0, 0.0]]]))
        if step < 99:
            assert not outcome.rotated.any()
    assert outcome.timed_out.all()
    return np.asarray(outcome.rotated[0])


def test_rotating_in_place_is_turning_much_while_driving_little_before_the_limit() -> None:
    assert spinning(0.0, 1.0).tolist() == [True, False]
    assert spinning(0.0, 1.0, flips=True).tolist() == [True, False]
    # Not enough turn: 10 s at 0.6 rad/s are less than a whole turn.
    assert spinning(0.0, 0.6).tolist() == [False, False]
    # Too much way: 10 s at 0.03 m/s are more than 0.2 m.
    assert spinning(0.03, 1.0).tolist() == [False, False]


def test_what_was_long_before_the_limit_is_forgotten() -> None:
    navigation = started(Rules(time_limit=20.0), "differential")
    for step in range(100):
        w = 2.0 if step < 50 else 0.0
        outcome = navigation.step(np.array([[[0.0, w], [0.0, 0.0]]]))
    assert not outcome.rotated.any()


@dataclass(frozen=True)
class Busy:
    """The walled crossroad with two of its robots as people."""

    crossroad: Crossroad
    crowd: Crowd
    name: str = "busy"
    num_robots: int = 8
    half_extent: float = 3.0

    def place(self, rng: np.random.Generator) -> Placement:
        return self.crossroad.place(rng)


def busy(num_worlds: int, after_arrival: AfterArrival = AfterArrival.REBORN) -> Navigation:
    scenario = Busy(Crossroad(is_walled=True), Crowd(np.array([2, 5]), Motion.RANDOM_WALK))
    return Navigation(
        scenario,
        Fleet.of(8, kinematics="differential", priority=np.arange(1.0, 9.0)),
        Rules(after_arrival=after_arrival, wrecks_vanish=True),
        num_worlds=num_worlds,
        layout=ObservationLayout(has_memory=True),
        sensing=Sensing(
            position_noise=0.01, delay=1, dropout=0.1, lidar_noise=0.01, beam_dropout=0.02
        ),
    )


def episode(num_worlds: int, num_steps: int) -> tuple[World, Observations]:
    """State and observations after an episode of random actions, the same for each seed."""
    navigation = busy(num_worlds)
    navigation.reset(7)
    world, rng = navigation.world, np.random.default_rng(3)
    for _ in range(num_steps):
        noise = rng.normal(0.0, 0.3, (1, *world.position.shape[1:]))
        outcome = navigation.step(steer(world, world.preferred_velocity()) + noise)
        ended = outcome.over | outcome.timed_out
        if ended.any():
            navigation.reset(worlds=ended)
    return world, navigation.observe()


def require_same(one: tuple[World, Observations], other: tuple[World, Observations]) -> None:
    for name in one[0].arrays._fields:
        same = getattr(one[0], name).tobytes() == getattr(other[0], name).tobytes()
        assert same, name
    assert one[1].tobytes() == other[1].tobytes()


@pytest.mark.stress
def test_one_thread_and_two_make_the_same_episode_bit_for_bit() -> None:
    before = numba.get_num_threads()
    if before < 2:
        pytest.skip("numba has one thread here")
    runs = []
    try:
        for threads in (1, 2):
            numba.set_num_threads(threads)
            runs.append(episode(64, 120))
    finally:
        numba.set_num_threads(before)
    require_same(*runs)
    assert runs[0][0].collided.any() or runs[0][0].arrivals.any()


def test_the_same_seed_makes_the_same_episode_bit_for_bit() -> None:
    require_same(episode(5, 150), episode(5, 150))


@pytest.mark.stress
def test_a_hundred_thousand_random_steps_leave_no_nan_no_warning_and_no_memory() -> None:
    navigation = busy(1)
    navigation.reset(0)
    world, rng = navigation.world, np.random.default_rng(1)
    most_used = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for step in range(100_000):
            outcome = navigation.step(rng.normal(0.0, 1.0, (1, 8, 2)))
            observation = navigation.observe()
            if outcome.over[0] or outcome.timed_out[0]:
                navigation.reset()
            if step % 1000 == 999:
                most_used.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
                for name in ("position", "velocity", "heading", "turn_rate"):
                    assert np.isfinite(getattr(world, name)).all(), name
                assert np.isfinite(observation).all()
                assert (np.abs(observation) <= 1.0).all()
    # After the first tenth, in which caches fill: less than 4 MB in 90 000 steps of 10 kB of results each. In kB.
    assert most_used[-1] - most_used[10] < 4096

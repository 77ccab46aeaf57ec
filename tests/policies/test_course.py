"""Tests of the course: who acts, what is paid to whom, and that no episode knows of the next."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from envs.scenarios import Placement
from policies.action_map import to_command
from policies.course import Course, CourseStep
from policies.experience import SingleArray
from policies.filtering import NUM_BEAMS, Filtering
from policies.stopwatch import Stopwatch
from policies.training_settings import USUAL_REWARD, CourseSettings, TrainingSettings
from safefilter.arrays import FloatArray

OFF = Filtering("off")
SMALL = TrainingSettings(
    layout=ObservationLayout(num_beams=4, has_memory=True),
    course=CourseSettings(num_worlds=4, num_robots=4, num_maps=3, map_steps=40, rollout_steps=8),
)
STAND, AHEAD = (-1.0, 0.0), (1.0, 0.0)
"""Raw actions: v = 0 and v = v_max."""


@dataclass(frozen=True)
class Fixed:
    """Always the same starts and goals; robots face their goals.

    Attributes:
        start: In m.
        goal: In m.
    """

    start: tuple[tuple[float, float], ...]
    goal: tuple[tuple[float, float], ...]
    name: str = "fixed"
    half_extent: float = 5.0

    @property
    def num_robots(self) -> int:
        return len(self.start)

    def place(self, _rng: np.random.Generator) -> Placement:
        return Placement(np.array(self.start), np.array(self.goal))


def fixed(
    start: list[tuple[float, float]], goal: list[tuple[float, float]], **changes: Any
) -> Course:
    """A course of one world."""
    course = replace(SMALL.course, num_worlds=1, num_robots=len(start), map_steps=1000)
    settings = replace(SMALL, course=course, **{"filtering": OFF, **changes})
    return Course(settings, Fixed(tuple(start), tuple(goal)))


def raw(*actions: tuple[float, float]) -> SingleArray:
    """Raw actions of the robots of a single world."""
    return np.array(actions, np.float32).reshape(-1, 2)


def drive_until(
    course: Course, is_there: Callable[[CourseStep], object], *actions: tuple[float, float]
) -> CourseStep:
    """The first step, of the same actions over and over, after which something is so."""
    for _ in range(200):
        step = course.step(raw(*actions))
        if is_there(step):
            return step
    pytest.fail("never")


def drawn(course: Course, rng: np.random.Generator) -> SingleArray:
    """Raw actions of a network that has learnt nothing, mostly forward."""
    number = course.navigation.world.v_max.size
    return rng.normal([0.8, 0.0], 0.6, (number, 2)).astype(np.float32)


def drive(course: Course, num_steps: int, seed: int = 0) -> list[CourseStep]:
    rng = np.random.default_rng(seed)
    steps = []
    for step in range(num_steps):
        if step % SMALL.course.rollout_steps == 0:
            course.renew()
        steps.append(course.step(drawn(course, rng)))
    return steps


def seen_and_paid(course: Course, num_steps: int, seed: int = 0) -> list[bytes]:
    rng = np.random.default_rng(seed)
    seen = []
    for step in range(num_steps):
        if step % SMALL.course.rollout_steps == 0:
            course.renew()
        seen.append(course.observe().tobytes())
        seen.append(course.step(drawn(course, rng)).reward.total.tobytes())
    return seen


def test_the_filter_lets_nobody_collide_over_many_maps() -> None:
    steps = drive(Course(SMALL), 200)
    assert not any(step.collided.any() for step in steps)
    assert all(step.acted.any() for step in steps)


def test_without_filter_somebody_does_and_acts_no_more_on_that_map() -> None:
    course = Course(replace(SMALL, filtering=OFF))
    hit = np.zeros((4, 4), dtype=np.bool_)
    rng = np.random.default_rng(0)
    for _ in range(60):
        step = course.step(drawn(course, rng))
        assert not (hit & step.acted).any()
        assert not step.reward.total[hit].any()
        hit |= step.collided
    assert hit.any()


def test_what_is_executed_without_filter_is_what_the_policy_says_within_bounds() -> None:
    course = Course(replace(SMALL, filtering=OFF))
    action = np.linspace(-2.0, 2.0, 32, dtype=np.float32).reshape(16, 2)
    step = course.step(action)
    np.testing.assert_allclose(step.executed.reshape(16, 2), np.clip(action, -1.0, 1.0), atol=1e-6)


def test_what_is_executed_stands_for_the_commands_that_moved_the_robots() -> None:
    # Two robots nose to nose: the filter cannot let them go on.
    course = fixed([(-0.15, 0.0), (0.15, 0.0)], [(2.0, 0.0), (-2.0, 0.0)], filtering=Filtering())
    world = course.navigation.world
    step = course.step(raw(AHEAD, AHEAD))
    commands = to_command(step.executed, world.v_max, world.omega_max)
    speeds = np.linalg.norm(world.velocity, axis=-1)
    np.testing.assert_allclose(speeds, commands[..., 0], rtol=0.05)
    assert (commands[..., 0] < 0.5 * world.v_max).all()


def test_a_change_by_the_filter_is_charged_and_no_change_is_free() -> None:
    weights = RewardWeights(intervention=-1.0)
    near = [(-0.15, 0.0), (0.15, 0.0)]
    for start, is_changed in ((near, True), ([(-3.0, 0.0), (3.0, 0.0)], False)):
        course = fixed(start, [(4.0, 0.0), (-4.0, 0.0)], filtering=Filtering(), reward=weights)
        paid = course.step(raw(AHEAD, AHEAD)).reward.intervention
        assert (paid < 0.0).all() == is_changed
        assert paid.any() == is_changed


def test_an_arrival_ends_the_episode_and_the_next_step_is_one_of_another() -> None:
    course = fixed([(0.0, 0.0), (0.0, 2.0)], [(0.3, 0.0), (4.0, 2.0)])
    world = course.navigation.world
    step = drive_until(course, lambda step: step.ends.any(), AHEAD, STAND)
    assert step.ends.tolist() == step.arrived.tolist() == [[True, False]]
    assert step.reward.goal[0].tolist() == [RewardWeights().goal, 0.0]
    # 0.3 m less the 0.12 m of a goal, at 0.04 m a step: in the fifth.
    assert step.cycle_time[0, 0] == pytest.approx(5 * 0.2)
    assert np.isnan(step.cycle_time[0, 1])
    # Reborn at once: what is seen now is the start of the next way, and is paid from there.
    assert world.position[0, 0].tolist() == [0.0, 0.0]
    step = course.step(raw(AHEAD, STAND))
    assert step.acted.all()
    assert step.reward.forward[0, 0] == pytest.approx(USUAL_REWARD.forward * 0.04)


def test_a_robot_reborn_remembers_nothing_of_its_way_there() -> None:
    course = fixed([(0.0, 0.0), (0.0, 2.0)], [(0.3, 0.0), (4.0, 2.0)])
    fresh = course.observe()[0, 0].copy()
    course.step(raw(AHEAD, STAND))
    assert not np.array_equal(course.observe()[0, 0], fresh)
    drive_until(course, lambda step: step.ends.any(), AHEAD, STAND)
    layout = SMALL.layout
    memory = next(block for block in layout.blocks if block.name == "memory")
    there = slice(memory.start, memory.start + memory.size)
    np.testing.assert_array_equal(course.observe()[0, 0, there], fresh[there])


def test_one_who_waits_to_be_reborn_does_not_act_and_what_hits_it_is_not_its_end() -> None:
    # The first arrives and waits, as the second stands where it started; the third rams it.
    start = [(0.0, 0.0), (-0.3, 0.0), (0.25, 1.0)]
    course = fixed(start, [(0.25, 0.0), (-3.0, 0.0), (0.25, -4.0)])
    world = course.navigation.world
    world.heading[0, 1] = 0.0
    drive_until(course, lambda _: world.arrived[0, 0], AHEAD, AHEAD, STAND)
    waited = course.step(raw(AHEAD, STAND, STAND))
    assert waited.acted.tolist() == [[False, True, True]]
    assert waited.executed[0, 0].tolist() == [-1.0, 0.0]
    step = drive_until(course, lambda _: world.collided[0, 2], AHEAD, STAND, AHEAD)
    assert world.collided[0].tolist() == [True, False, True]
    assert step.collided.tolist() == step.ends.tolist() == [[False, False, True]]
    assert step.reward.total[0, 0] == 0.0


def test_worlds_change_their_maps_when_their_time_is_over_and_no_others_do() -> None:
    course = Course(SMALL)
    world = course.navigation.world
    ages = []
    for step in range(5 * SMALL.course.map_steps):
        if step % SMALL.course.rollout_steps == 0:
            before, goals = world.step_count.copy(), world.goal.copy()
            course.renew()
            is_new = world.step_count == 0
            ages += before[is_new & (before > 0)].tolist()
            np.testing.assert_array_equal(world.step_count[~is_new], before[~is_new])
            np.testing.assert_array_equal(world.goal[~is_new], goals[~is_new])
        course.step(np.tile(np.array(STAND, dtype=np.float32), (16, 1)))
    # A world can be late by less than a rollout; only the first maps are left sooner.
    assert max(ages) < SMALL.course.map_steps + SMALL.course.rollout_steps
    assert sum(age < SMALL.course.map_steps for age in ages) <= 4
    assert len(ages) >= 4 * 4


def test_worlds_do_not_all_change_their_maps_at_once() -> None:
    course = Course(replace(SMALL, course=replace(SMALL.course, num_worlds=32)))
    still = np.tile(np.array(STAND, dtype=np.float32), (course.navigation.world.v_max.size, 1))
    changed = []
    for _ in range(SMALL.course.map_steps):
        course.step(still)
        before = course.navigation.world.step_count.copy()
        course.renew()
        changed.append(int((course.navigation.world.step_count != before).sum()))
    assert sum(changed) >= 32
    assert max(changed) < 8


def test_a_world_of_wrecks_gets_another_map_before_its_time() -> None:
    start = [(0.0, 0.0), (0.0, 0.5), (3.0, 0.0), (-3.0, 0.0)]
    course = fixed(start, [(0.0, 4.0), (0.0, -4.0), (3.0, 4.0), (-3.0, 4.0)])
    world = course.navigation.world
    drive_until(course, lambda _: world.collided.any(), AHEAD, AHEAD, STAND, STAND)
    assert world.collided[0].tolist() == [True, True, False, False]
    course.renew()
    # Half of them are no more than half.
    assert world.collided.any()
    world.collided[0, 2] = True
    course.renew()
    assert not world.collided.any()
    assert world.step_count[0] == 0


def test_time_is_never_over_within_a_map() -> None:
    course = Course(SMALL)
    longest = SMALL.course.map_steps + SMALL.course.rollout_steps
    assert course.navigation.rules.max_steps > longest


def test_walls_are_known_from_what_the_filtering_says() -> None:
    assert Course(SMALL).navigation.rules.num_beams == 0
    scanned = Course(replace(SMALL, filtering=Filtering(walls="lidar")))
    assert scanned.navigation.rules.num_beams == NUM_BEAMS
    assert not any(step.collided.any() for step in drive(scanned, 20))


def test_the_same_seed_gives_the_same_course_bit_for_bit_and_another_another() -> None:
    one, same = (seen_and_paid(Course(SMALL), 60) for _ in range(2))
    assert one == same
    assert seen_and_paid(Course(replace(SMALL, seed=2)), 1) != one[:2]


def test_what_happens_in_a_world_does_not_depend_on_how_many_others_there_are() -> None:
    many = Course(SMALL).observe()
    few = Course(replace(SMALL, course=replace(SMALL.course, num_worlds=2))).observe()
    np.testing.assert_array_equal(many[:2], few)


def test_a_restored_course_goes_on_bit_for_bit_over_map_changes() -> None:
    course = Course(SMALL)
    drive(course, 35)
    kept = course.state()
    expected = seen_and_paid(course, 60, seed=1)
    other = Course(replace(SMALL, seed=7))
    other.restore(kept)
    assert seen_and_paid(other, 60, seed=1) == expected
    # The state was not written to meanwhile.
    again = Course(SMALL)
    again.restore(kept)
    assert seen_and_paid(again, 60, seed=1) == expected


def test_the_stopwatch_is_told_of_simulator_and_filter() -> None:
    watch = Stopwatch()
    course = Course(SMALL, stopwatch=watch)
    course.step(np.zeros((16, 2), np.float32))
    assert set(watch.seconds) == {"simulator", "filter"}


def test_nobody_under_way_is_no_error() -> None:
    course = fixed([(0.0, 0.0), (0.0, 2.0)], [(3.0, 0.0), (3.0, 2.0)], filtering=Filtering())
    course.navigation.world.collided[...] = True
    step = course.step(raw(AHEAD, AHEAD))
    assert not step.acted.any()
    assert not step.reward.total.any()


def test_speeds_of_new_maps_are_known_to_the_filter() -> None:
    course = Course(SMALL)
    world = course.navigation.world
    first: FloatArray = world.v_max.copy()
    drive(course, 2 * SMALL.course.map_steps)
    assert not np.array_equal(world.v_max, first)
    step = course.step(np.tile(np.array(AHEAD, dtype=np.float32), (16, 1)))
    speed = np.linalg.norm(world.velocity, axis=-1)
    assert (speed <= world.v_max + 1e-9).all()
    assert not step.collided.any()

from dataclasses import dataclass, field

import numpy as np
import pytest

from envs import Fleet, Navigation, Rules
from envs.crowd import Crowd, Motion
from envs.scenarios import Placement
from envs.scenarios.scenario import chain
from safefilter import DifferentialDrive, PriorityORCA, SafetyFilter, Separation
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, OutOfRange

BOX = chain((2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0))


@dataclass(frozen=True)
class Street:
    """Robot 0 wants to go north; people 1, 2 and 3 go east, west and south."""

    crowd: Crowd
    walls: FloatArray = field(default_factory=lambda: BOX)
    name: str = "street"
    num_robots: int = 4
    half_extent: float = 2.0

    def place(self, rng: np.random.Generator) -> Placement:
        start = np.array([[0.0, -1.5], [-1.5, 0.4], [1.5, -0.4], [0.9, 1.5]])
        goal = np.array([[0.0, 1.5], [1.5, 0.4], [-1.5, -0.4], [0.9, -1.5]])
        return Placement(start + rng.uniform(-0.01, 0.01, (4, 2)), goal, self.walls)


def street(motion: Motion, num_worlds: int = 1, seed: int = 0) -> Navigation:
    navigation = Navigation(
        Street(Crowd(np.array([1, 2, 3]), motion)),
        Fleet.of(4, v_max=[0.2, 0.15, 0.1, 0.12], kinematics="differential"),
        Rules(time_limit=200.0),
        num_worlds=num_worlds,
    )
    navigation.reset(seed)
    return navigation


def walk(navigation: Navigation, num_steps: int) -> FloatArray:
    """Places of everyone while robot 0 stands still, shape (T, W, N, 2)."""
    ways = [navigation.world.position.copy()]
    for _ in range(num_steps):
        navigation.step(np.zeros(navigation.world.position.shape))
        ways.append(navigation.world.position.copy())
    return np.array(ways)


def test_people_are_known_not_to_cooperate_and_are_not_under_way() -> None:
    navigation = street(Motion.RANDOM_WALK)
    assert navigation.world.cooperative.tolist() == [[True, False, False, False]]
    assert navigation.world.active.tolist() == [[True, False, False, False]]
    assert navigation.scene().cooperative.tolist() == [True, False, False, False]


def test_people_of_constant_velocity_go_straight_there_and_back() -> None:
    navigation = street(Motion.CONSTANT_VELOCITY)
    world = navigation.world
    ways = walk(navigation, 90)
    step = np.diff(ways[:, 0, 1:], axis=0)
    np.testing.assert_allclose(np.linalg.norm(step[:90], axis=-1)[:, 0], 0.03, atol=1e-12)
    ahead = world.goal[0, 1:] - world.start[0, 1:]
    across = np.cross(
        np.concatenate([ahead, np.zeros((3, 1))], axis=1),
        np.concatenate([ways[-1, 0, 1:] - world.start[0, 1:], np.zeros((3, 1))], axis=1),
    )
    np.testing.assert_allclose(across, 0.0, atol=1e-9)
    again = walk(navigation, 110)
    # 3 m at 0.15 m/s take 100 steps; after 200 the person is back at its start, or just turned there.
    assert np.linalg.norm(again[-1, 0, 1] - world.start[0, 1]) < 0.4
    assert np.linalg.norm(again[10, 0, 1] - world.goal[0, 1]) < 0.2
    assert not world.collided[0, 1:].any()


@pytest.mark.parametrize("motion", list(Motion))
def test_people_stay_between_walls(motion: Motion) -> None:
    ways = walk(street(motion, num_worlds=20), 300)
    assert (np.abs(ways[:, :, 1:]) <= 2.0 - 0.105 + 1e-9).all()
    assert np.linalg.norm(np.diff(ways[:, :, 1:], axis=0), axis=-1).max() <= 0.03 * (1.0 + 1e-6)


def test_random_walks_wander_at_full_speed_and_differ_from_world_to_world() -> None:
    ways = walk(street(Motion.RANDOM_WALK, num_worlds=50), 100)
    speed = np.linalg.norm(np.diff(ways[:, :, 1], axis=0), axis=-1) / 0.2
    assert np.median(speed) == pytest.approx(0.15)
    assert np.std(ways[-1, :, 1], axis=0).min() > 0.2


def test_social_force_keeps_people_apart_who_would_meet() -> None:
    def least_gap(motion: Motion) -> float:
        scenario = Street(Crowd(np.array([1, 2, 3]), motion), np.zeros((0, 2, 2)))
        navigation = Navigation(scenario, Fleet.of(4, v_max=0.15))
        navigation.reset(0)
        world = navigation.world
        # Head-on, a little beside each other.
        world.position[0, 1:3] = [[-1.0, 0.02], [1.0, -0.02]]
        world.goal[0, 1:3] = [[1.5, 0.02], [-1.5, -0.02]]
        ways = walk(navigation, 80)
        return float(np.linalg.norm(ways[:, 0, 1] - ways[:, 0, 2], axis=-1).min()) - 0.21

    assert least_gap(Motion.CONSTANT_VELOCITY) < -0.1
    assert least_gap(Motion.SOCIAL_FORCE) > 0.0


def test_people_do_not_depend_on_how_many_worlds_there_are() -> None:
    few, many = (walk(street(Motion.RANDOM_WALK, n), 40) for n in (2, 130))
    np.testing.assert_array_equal(few, many[:, :2])


def test_people_that_meet_each_other_are_not_judged_but_a_robot_is() -> None:
    navigation = street(Motion.CONSTANT_VELOCITY)
    world = navigation.world
    world.position[0, 1:3] = [[-0.5, 0.0], [0.5, 0.0]]
    world.goal[0, 1:3] = [[1.5, 0.0], [-1.5, 0.0]]
    world.position[0, 0] = [1.0, 0.0]
    for _ in range(50):
        navigation.step(np.zeros((1, 4, 2)))
    assert world.collided[0].tolist() == [True, True, False, False]


def test_a_filtered_robot_is_not_the_one_that_runs_into_people() -> None:
    navigation = street(Motion.SOCIAL_FORCE, num_worlds=10)
    drive = DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05)
    safety = SafetyFilter([PriorityORCA(2.0), Separation(0.2, passive_speed=0.16)], drive)
    index = np.flatnonzero(navigation.world.cooperative.ravel())
    for _ in range(150):
        actions = np.zeros((10, 4, 2))
        actions[:, 0] = [0.2, 0.0]
        rows = actions.reshape(-1, 2)
        is_free = ~navigation.world.collided.ravel()[index]
        chosen = index[is_free & navigation.world.cooperative.ravel()[index]]
        rows[chosen] = safety.decide(navigation.scenes(), rows[chosen], chosen).action
        outcome = navigation.step(actions)
        moved = np.linalg.norm(navigation.world.velocity[:, 0], axis=-1)
        # Who touches it while it moves nowhere near has come to it, see docs/guarantees.md.
        assert not (outcome.hit_robot[:, 0] & (moved > 0.0)).any()


def test_impossible_crowds_are_refused() -> None:
    with pytest.raises(InvalidInput, match="people: expected each robot once"):
        Crowd(np.array([1, 1]))
    with pytest.raises(OutOfRange, match="people: expected numbers below 4"):
        Navigation(Street(Crowd(np.array([4]))))
    with pytest.raises(OutOfRange, match="strength: expected a number above 0"):
        Crowd(np.array([1]), strength=0.0)
    with pytest.raises(InvalidInput, match="motion: expected one of"):
        Crowd(np.array([1]), "fly")  # type: ignore[arg-type]  # that is the point

import numpy as np
import pytest

from envs import Circle, Crossroad, Fleet, Navigation, Rules, UShape
from envs.lidar import cast_beams
from envs.observation import Observer
from envs.observation_layout import ObservationLayout, Observations
from envs.sensing import Sensing
from envs.trail import HALF, SCALE
from envs.world import World
from safefilter.arrays import FloatArray


def pair(*, distance: float = 1.0, priority: tuple[float, float] = (1.0, 3.0)) -> World:
    """Robot 1 stands north of robot 0, whose goal is 3 m east."""
    world = World.empty(1, Fleet.of(2, priority=priority, v_max=0.2, radius=0.1))
    world.present[...] = True
    world.position[0, 1] = [0.0, distance]
    world.goal[0] = [[3.0, 0.0], [0.0, distance]]
    world.velocity[0, 0] = [0.1, 0.0]
    return world


def see(world: World, layout: ObservationLayout, sensing_range: float = 9.0) -> Observations:
    return Observer(world, Rules(sensing_range=sensing_range), layout).observe()


def own_of(world: World) -> Observations:
    return see(world, ObservationLayout(0, 0))


def neighbours_of(world: World, num: int = 1, sensing_range: float = 9.0) -> Observations:
    layout = ObservationLayout(num, 0)
    return layout.as_dict(see(world, layout, sensing_range))["neighbours"]


def test_own_block_tells_goal_motion_and_what_it_is() -> None:
    expected = [0.5, 1.0, 1.0, 0.0, 0.5, 0.0, 0.5, 0.5, np.exp(-9.0)]
    np.testing.assert_allclose(own_of(pair())[0, 0], expected, atol=1e-6)


def test_own_block_at_the_goal_has_no_direction() -> None:
    expected = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.75, 1.0]
    np.testing.assert_allclose(own_of(pair())[0, 1], expected, atol=1e-6)


def test_drives_tell_speed_and_turn_rate_in_their_own_axes() -> None:
    fleet = Fleet.of(1, kinematics="differential")
    world = World.empty(1, fleet)
    world.present[...] = True
    world.goal[0] = [[0.0, 0.5]]
    world.heading[...] = 0.5 * np.pi
    world.velocity[0, 0] = [0.0, 0.05]
    world.turn_rate[...] = -1.25
    own = own_of(world)[0, 0]
    np.testing.assert_allclose(own[1:6], [0.5, 1.0, 0.0, 0.25, -0.5], atol=1e-6)


def test_neighbour_block_tells_where_how_near_how_fast_and_how_important() -> None:
    world = pair()
    world.heading[0, 1] = 0.5 * np.pi
    block = neighbours_of(world)[0, 0, 0]
    expected = [0.0, 1.0, np.exp(-1.5 * 0.8), np.exp(-8.0 * 0.8), -0.25, 0.0, 0.0, 1.0, 0.75]
    np.testing.assert_allclose(block, expected, atol=1e-6)


def test_what_is_hidden_in_the_paper_is_hidden() -> None:
    world, other = pair(), pair()
    other.goal[0, 1] = [-7.0, 2.0]
    other.v_max[0, 1] = 3.0
    other.omega_max[0, 1] = 1.0
    seen, same = (see(one, ObservationLayout())[0, 0] for one in (world, other))
    np.testing.assert_array_equal(seen, same)


def test_priority_shares_of_a_pair_sum_to_one() -> None:
    shares = neighbours_of(pair(priority=(2.0, 7.0)))[0, :, 0, 8]
    assert shares.sum() == pytest.approx(1.0, abs=1e-6)


def test_robots_out_of_range_or_without_a_body_are_not_seen() -> None:
    assert (neighbours_of(pair(distance=2.0), 1, 1.9) == 0.0).all()
    assert neighbours_of(pair(distance=2.0), 1, 2.0)[0, 0, 0, 2] > 0.0
    world = pair()
    world.present[0, 1] = False
    assert (neighbours_of(world) == 0.0).all()


def test_robots_on_one_spot_see_each_other_without_a_direction() -> None:
    block = neighbours_of(pair(distance=0.0))[0, 0, 0]
    np.testing.assert_array_equal(block[:4], [0.0, 0.0, 1.0, 1.0])


@pytest.mark.parametrize("num_robots", [6, 60])
def test_neighbours_are_the_nearest_ones_nearest_first(num_robots: int) -> None:
    navigation = Navigation(Circle(num_robots))
    navigation.reset(0)
    world = navigation.world
    blocks = neighbours_of(world, 7)[0]
    offset = world.position[0] - world.position[0, :, np.newaxis]
    away = np.sort(np.linalg.norm(offset, axis=-1), axis=1)[:, 1:8]
    expected = np.where(away <= 9.0, np.exp(-1.5 * (away - 2 * 0.105)), 0.0)
    found = blocks[..., 2][:, : expected.shape[1]]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert (blocks[:, expected.shape[1] :] == 0.0).all()


def test_turning_the_world_changes_nothing_for_drives() -> None:
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def crossing(matrix: FloatArray, by: float) -> Observations:
        navigation = started(Crossroad(is_walled=True))
        world = navigation.world
        walls = world.walls_of(0) @ matrix.T
        for array in (world.position, world.goal, world.velocity):
            array[...] = array @ matrix.T
        world.heading[...] += by
        world.walls.replace({0: walls})
        return navigation.observe()

    np.testing.assert_allclose(crossing(turn, angle), crossing(np.eye(2), 0.0), atol=2e-6)


def started(scenario: Crossroad, **options: object) -> Navigation:
    fleet = Fleet.of(8, kinematics="differential")
    navigation = Navigation(scenario, fleet, **options)  # type: ignore[arg-type]  # of any of them
    navigation.reset(3)
    for _ in range(10):
        navigation.step(np.full(navigation.world.position.shape, 0.1))
    return navigation


def test_the_lidar_block_is_what_beams_see() -> None:
    navigation = started(Crossroad(is_walled=True))
    layout = navigation.observer.layout
    beams = layout.as_dict(navigation.observe())["lidar"]
    expected = np.exp(-1.2 * cast_beams(navigation.world, 36, 3.5))
    np.testing.assert_allclose(beams, expected, atol=1e-6)


def test_memory_holds_own_places_in_present_axes() -> None:
    navigation = started(Crossroad(), layout=ObservationLayout(0, 0, has_memory=True))
    before = navigation.world.position.copy()
    heading = navigation.world.heading.copy()
    # A quarter turn to the left and 3 s straight on: where it was lies behind.
    navigation.world.heading[...] = heading + 0.5 * np.pi
    for _ in range(15):
        navigation.step(np.broadcast_to([0.2, 0.0], before.shape))
    memory = navigation.observe()[..., 9:]
    np.testing.assert_allclose(memory[..., 0:4:2], -1.0, atol=1e-4)
    np.testing.assert_allclose(memory[..., 1:4:2], 0.0, atol=1e-4)
    # 6 s ago and before: the way of 5 s at most since the start, over what 24 s would have allowed.
    assert (np.abs(memory[..., 8:10]) < 5.0 / 24.0).all()
    # They drive across their ways: nothing is gained from the moment of the turn on.
    away = np.linalg.norm(navigation.world.goal - navigation.world.position, axis=-1)
    least = np.linalg.norm(navigation.world.goal - before, axis=-1)
    assert (away >= least).all()
    np.testing.assert_allclose(memory[..., 10], least / (least + 3.0), atol=1e-5)
    extra = away - least
    np.testing.assert_allclose(memory[..., 11], extra / (extra + 1.0), atol=1e-5)
    np.testing.assert_allclose(memory[..., 12], 3.0 / 13.0, atol=1e-6)


def test_the_trail_is_where_the_robot_has_come_from() -> None:
    layout = ObservationLayout(0, 0, has_trail=True)
    fleet = Fleet.of(1, kinematics="differential")
    navigation = Navigation(UShape(num_robots=1), fleet, layout=layout)
    navigation.reset(0)
    start = navigation.world.position[0, 0].copy()
    for _ in range(15):
        navigation.step(np.full((1, 1, 2), [0.2, 0.0]))
    # 3 s, so two places: the start 0.6 m behind, and one 0.2 m behind.
    behind = np.hypot(*(navigation.world.position[0, 0] - start))
    weights = [(1.0 + (distance / SCALE) ** 2) ** -2 for distance in (behind, behind - 0.4)]
    expected = np.zeros(8)
    expected[4] = sum(weights) / (sum(weights) + HALF)
    np.testing.assert_allclose(navigation.observe()[0, 0, -8:], expected, atol=1e-6)


def test_reset_forgets() -> None:
    navigation = started(Crossroad(), layout=ObservationLayout(0, 0, has_memory=True))
    navigation.reset(5)
    memory = navigation.observe()[..., 9:]
    np.testing.assert_allclose(memory[..., :10], 0.0, atol=1e-6)
    assert (memory[..., 11:] == 0.0).all()


def test_noise_and_lost_beams_are_what_was_asked_for() -> None:
    sensing = Sensing(lidar_noise=0.05, beam_dropout=0.25)
    fleet = Fleet.of(8, kinematics="differential")
    scenario = Crossroad(is_walled=True)
    noisy, exact = (
        Navigation(scenario, fleet, num_worlds=60, sensing=given) for given in (sensing, None)
    )
    ranges = []
    for navigation in (noisy, exact):
        navigation.reset(0)
        beams = navigation.observer.layout.as_dict(navigation.observe())["lidar"]
        ranges.append(-np.log(np.maximum(beams, 1e-9)) / 1.2)
    hit = (ranges[1] < 3.0) & (ranges[1] > 0.3)
    came_back = hit & (ranges[0] < 5.0)
    assert came_back.sum() / hit.sum() == pytest.approx(0.75, abs=0.02)
    error = (ranges[0] - ranges[1])[came_back]
    assert error.std() == pytest.approx(0.05, rel=0.05)
    assert error.mean() == pytest.approx(0.0, abs=0.005)


def test_observations_stay_within_their_bounds() -> None:
    layout = ObservationLayout(has_memory=True)
    navigation = Navigation(Crossroad(is_walled=True), num_worlds=40, layout=layout)
    navigation.reset(3)
    for _ in range(30):
        observation = navigation.observe()
        assert observation.dtype == np.float32
        assert (np.abs(observation) <= 1.0).all()
        navigation.step(1.5 * navigation.world.preferred_velocity())


def test_only_robots_asked_about_are_observed_and_as_among_all() -> None:
    navigation = started(Crossroad(), num_worlds=3)
    every = navigation.observe()
    chosen = np.random.default_rng(0).random(navigation.world.present.shape) < 0.4
    chosen[1] = False
    some = navigation.observe(chosen)
    np.testing.assert_array_equal(some[chosen], every[chosen])
    assert (some[~chosen] == 0.0).all()
    assert (every[~chosen] != 0.0).any()

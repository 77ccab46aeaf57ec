import numpy as np
import pytest
import shapely

from envs import Corridor, Fleet, Navigation, Rules
from envs.lidar import cast_beams, scan_walls
from envs.lidar_kernel import FEW_BEAMS
from envs.observation_layout import ObservationLayout
from envs.sensing import Sensing
from envs.world import World
from safefilter.arrays import FloatArray
from safefilter.lidar import Lidar

BOX = np.array([
    [[1.0, -1.0], [1.0, 1.0]],
    [[1.0, 1.0], [-1.0, 1.0]],
    [[-1.0, 1.0], [-1.0, -1.0]],
    [[-1.0, -1.0], [1.0, -1.0]],
])


def world_of(place: list[list[float]]) -> World:
    world = World.empty(1, Fleet.of(len(place), radius=0.1))
    world.present[...] = True
    world.position[0] = place
    world.walls.replace({0: BOX})
    return world


def test_beams_from_the_middle_of_a_box_reach_its_sides_and_corners() -> None:
    ranges = cast_beams(world_of([[0.0, 0.0]]), 360, 3.5)[0, 0]
    angle = np.radians(np.arange(360))
    np.testing.assert_allclose(
        ranges, 1.0 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    )


def test_beams_turn_with_the_heading() -> None:
    world = world_of([[0.5, 0.0]])
    world.heading[...] = 0.5 * np.pi
    ranges = cast_beams(world, 4, 3.5)[0, 0]
    np.testing.assert_allclose(ranges, [1.0, 1.5, 1.0, 0.5])


def test_robots_hide_what_is_behind_them_unless_they_are_gone() -> None:
    world = world_of([[0.0, 0.0], [0.5, 0.0]])
    assert cast_beams(world, 16, 3.5)[0, 0, 0] == pytest.approx(0.4)
    world.present[0, 1] = False
    ranges = cast_beams(world, 16, 3.5)[0]
    assert ranges[0, 0] == pytest.approx(1.0)
    assert np.isinf(ranges[1]).all()


def test_nothing_comes_back_from_beyond_the_range() -> None:
    ranges = cast_beams(world_of([[0.0, 0.0]]), 8, 1.2)[0, 0]
    assert np.isinf(ranges).tolist() == [False, True] * 4


def clear_of(walls: FloatArray, rng: np.random.Generator, num_robots: int) -> list[list[float]]:
    """Places well inside of the box that no wall passes within 1 cm of, apart from each other."""
    places: list[list[float]] = []
    lines = shapely.MultiLineString(walls.tolist())
    while len(places) < num_robots:
        place = rng.uniform(-4.5, 4.5, 2)
        apart = all(np.hypot(*(place - other)) > 0.25 for other in places)
        if apart and not lines.distance(shapely.Point(place)) <= 0.01:
            places.append(place.tolist())
    return places


@pytest.mark.parametrize("num_walls", [0, 7, 24, 25, 150])
@pytest.mark.parametrize("num_robots", [1, 5, 40])
def test_ranges_equal_the_intersections_that_shapely_finds(num_walls: int, num_robots: int) -> None:
    rng = np.random.default_rng([num_walls, num_robots])
    start = rng.uniform(-5.0, 5.0, (num_walls, 2))
    walls = np.stack([start, start + rng.uniform(-2.0, 2.0, (num_walls, 2))], axis=1)
    world = World.empty(1, Fleet.of(num_robots, radius=rng.uniform(0.05, 0.12, num_robots)))
    world.present[...] = True
    world.position[0] = clear_of(walls, rng, num_robots)
    world.heading[...] = rng.uniform(-4.0, 4.0, (1, num_robots))
    world.walls.replace({0: walls})
    ranges = cast_beams(world, 37, 3.5)
    for i in range(min(num_robots, 8)):
        place = world.position[0, i]
        discs = [
            (world.position[0, j], float(world.radius[0, j])) for j in range(num_robots) if j != i
        ]
        for k in range(37):
            angle = world.heading[0, i] + k * (2.0 * np.pi / 37)
            expected = nearest_by_shapely(place, angle, walls, discs)
            if expected > 3.5:
                expected = np.inf
            assert ranges[0, i, k] == pytest.approx(expected, abs=1e-9), (i, k)


def test_few_beams_see_what_the_same_ones_of_many_see() -> None:
    # Of few beams all are looked at, of many only those near a wall's ends.
    rng = np.random.default_rng(4)
    start = rng.uniform(-4.0, 4.0, (60, 2))
    world = World.empty(1, Fleet.of(30, radius=0.1))
    world.present[...] = True
    world.walls.replace({0: np.stack([start, start + rng.uniform(-1.0, 1.0, (60, 2))], axis=1)})
    world.position[0], world.heading[0] = rng.uniform(-4.0, 4.0, (30, 2)), rng.uniform(-3, 3, 30)
    few = cast_beams(world, FEW_BEAMS, 3.5)
    many = cast_beams(world, 10 * FEW_BEAMS, 3.5)
    assert np.isfinite(few).sum() > 500
    np.testing.assert_allclose(few, many[..., ::10], rtol=1e-9)


@pytest.mark.parametrize("num_beams", [FEW_BEAMS, 360])
def test_a_wall_seen_from_its_edge_returns_no_more_than_its_ends(num_beams: int) -> None:
    # All but on the line of a wall, a rounding decides where on it a beam arrives: such walls are not met at all.
    world = World.empty(1, Fleet.of(1, radius=0.1))
    world.present[...] = True
    for offset in (0.0, 1e-17, -1e-16, 1e-12, -1e-10, 1e-8):
        world.walls.replace({0: np.array([[[1.0, offset], [2.0, 0.0]]])})
        for heading in (0.0, 1e-17, 1e-16, -1e-16, 0.3):
            world.heading[...] = heading
            ranges = cast_beams(world, num_beams, 3.5)
            met = ranges[np.isfinite(ranges)]
            assert ((met > 0.999) & (met < 2.001)).all()
            assert (len(met) > 0) == (offset == 1e-8 and heading != 0.3)


@pytest.mark.parametrize("num_beams", [1, 2, 3, 5, 64, 65, 90, 720])
def test_every_wall_is_painted_on_the_beams_between_its_ends(num_beams: int) -> None:
    rng = np.random.default_rng(num_beams)
    angle = 2.0 * np.pi * np.arange(num_beams) / num_beams
    for _ in range(30):
        low, width = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 3.0)
        ends = 2.0 * np.array([
            [np.cos(low), np.sin(low)],
            [np.cos(low + width), np.sin(low + width)],
        ])
        world = World.empty(1, Fleet.of(1, radius=0.1))
        world.present[...] = True
        world.walls.replace({0: ends[np.newaxis]})
        found = np.isfinite(cast_beams(world, num_beams, 3.5)[0, 0])
        np.testing.assert_array_equal(found, (angle - low) % (2.0 * np.pi) <= width)


def nearest_by_shapely(
    place: FloatArray, angle: float, walls: FloatArray, discs: list[tuple[FloatArray, float]]
) -> float:
    direction = np.array([np.cos(angle), np.sin(angle)])
    beam = shapely.LineString([place, place + 4.0 * direction])
    met = shapely.intersection(beam, shapely.linestrings(walls)) if len(walls) else np.array([])
    distances = [shapely.Point(place).distance(part) for part in met if not part.is_empty]
    for centre, radius in discs:
        # shapely's circles are polygons: the chord's middle is shapely's, the rest Pythagoras.
        offset = beam.distance(shapely.Point(centre))
        middle = beam.project(shapely.Point(centre))
        if offset < radius and middle > 0.0:
            distances.append(middle - np.sqrt(radius**2 - offset**2))
    return min(distances, default=np.inf)


def test_a_beam_along_a_wall_meets_the_walls_that_it_joins() -> None:
    world = world_of([[-0.5, 0.0]])
    world.walls.replace({0: np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]])})
    assert cast_beams(world, 4, 3.5)[0, 0, 0] == 0.5


@pytest.mark.parametrize("num_beams", [1, 3, 36, 1000])
def test_no_beam_slips_through_the_joints_of_a_polygon(num_beams: int) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1] = ring[0]
    world = world_of([[0.0, 0.0], [0.3, 0.2]])
    world.walls.replace({0: np.stack([ring[:-1], ring[1:]], axis=1)})
    world.heading[0] = [0.0, 1.0]
    assert np.isfinite(cast_beams(world, num_beams, 3.5)).all()


def test_walls_far_away_change_nothing() -> None:
    near = world_of([[0.2, -0.3]])
    far = world_of([[0.2, -0.3]])
    rng = np.random.default_rng(0)
    corner = rng.uniform(20.0, 90.0, (400, 2)) * rng.choice([-1.0, 1.0], (400, 2))
    others = np.stack([corner, corner + rng.uniform(-1.0, 1.0, (400, 2))], axis=1)
    far.walls.replace({0: np.concatenate([BOX, others])})
    np.testing.assert_array_equal(cast_beams(far, 36, 3.5), cast_beams(near, 36, 3.5))


def test_a_robot_inside_another_sees_nothing_else() -> None:
    assert (cast_beams(world_of([[0.0, 0.0], [0.05, 0.0]]), 8, 3.5) == 0.0).all()


def test_scenes_of_robots_without_a_map_hold_what_their_beams_saw() -> None:
    fleet = Fleet.of(4, kinematics="differential")
    navigation = Navigation(Corridor(), fleet, Rules(num_beams=90), num_worlds=2)
    navigation.reset(0)
    for scene in (navigation.scenes(), navigation.scene(1)):
        assert scene.num_shared_walls == 0
        assert scene.most_walls > 45
        start, seen = scene.wall_range[0].tolist(), scene.walls
        assert (np.abs(seen[start[0] : start[1], :4]) <= 2.5 + 1e-9).all()


def test_noise_of_beams_reaches_the_filter_and_the_observation_alike() -> None:
    sensing = Sensing(lidar_noise=0.05, beam_dropout=0.2)
    fleet = Fleet.of(4, kinematics="differential")
    layout = ObservationLayout(0, 36)
    rules = Rules(num_beams=36)
    navigation = Navigation(Corridor(), fleet, rules, layout=layout, sensing=sensing, num_worlds=2)
    navigation.reset(0)
    noisy = cast_beams(navigation.world, 36, 3.5, sensing=sensing)
    exact = cast_beams(navigation.world, 36, 3.5)
    assert (noisy != exact).any()
    seen = layout.as_dict(navigation.observe())["lidar"]
    np.testing.assert_allclose(seen, np.exp(-1.2 * noisy), atol=1e-6)
    walls = navigation.scenes().walls
    away = np.linalg.norm(walls[:, :2].reshape(-1, 1, 2) - navigation.world.position[:, 0], axis=-1)
    first = noisy[0, 0][np.isfinite(noisy[0, 0])]
    # Every return of the first robot is the start of one of its walls, but those that lie on robots.
    found = np.abs(away[:, :1] - first).min(axis=0) < 1e-9
    assert found.mean() > 0.8


def test_one_world_is_scanned_alone() -> None:
    navigation = Navigation(Corridor(), num_worlds=3)
    navigation.reset(0)
    every = cast_beams(navigation.world, 16, 3.5)
    second = cast_beams(navigation.world, 16, 3.5, worlds=slice(1, 2))
    np.testing.assert_array_equal(second[1], every[1])
    assert np.isinf(second[[0, 2]]).all()


def test_only_robots_that_scan_see_something() -> None:
    navigation = Navigation(Corridor(), num_worlds=2)
    navigation.reset(0)
    every = cast_beams(navigation.world, 16, 3.5)
    chosen = np.random.default_rng(0).random(navigation.world.present.shape) < 0.5
    some = cast_beams(navigation.world, 16, 3.5, chosen=chosen)
    np.testing.assert_array_equal(some[chosen], every[chosen])
    assert (some[~chosen] == np.inf).all()


def test_a_scan_is_what_beams_see_as_far_as_the_rules_say() -> None:
    navigation = Navigation(Corridor(), num_worlds=2)
    navigation.reset(0)
    rules = Rules(num_beams=16, lidar_range=3.5, wall_range=0.7)
    scan = scan_walls(navigation.world, rules, worlds=slice(1, 2))
    expected = cast_beams(navigation.world, 16, 0.7)[1]
    np.testing.assert_array_equal(scan.ranges, expected)
    checked = Lidar.scan(expected)
    np.testing.assert_array_equal(scan.angles, checked.angles)
    assert scan.corner_angle == checked.corner_angle
    assert not scan.ranges.flags.writeable

import numpy as np
import pytest

from envs.collision import (
    CONTACT_TOLERANCE,
    Bodies,
    Contacts,
    find_contacts,
    start_clearances,
)
from envs.collision_kernel import COARSENESS
from envs.dynamics import Movement
from envs.fleet import Fleet
from envs.walls import WallMap
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray

RADIUS = 0.1


def judge(
    position: object,
    displacement: object,
    *,
    radius: float = RADIUS,
    present: BoolArray | None = None,
    wrecked: BoolArray | None = None,
) -> Contacts:
    """One world."""
    where = np.array([position], dtype=np.float64)
    shape = where.shape[:2]
    return straight(
        where,
        np.array([displacement], dtype=np.float64),
        np.full(shape, radius),
        np.ones(shape, dtype=np.bool_) if present is None else present,
        np.zeros(shape, dtype=np.bool_) if wrecked is None else wrecked,
    )


def straight(
    position: FloatArray,
    displacement: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    wrecked: BoolArray,
) -> Contacts:
    """Nobody turns, and there are no walls."""
    movement = Movement(displacement, np.zeros(radius.shape), 1.0)
    return find_contacts(position, movement, Bodies(radius, present, wrecked, WallMap(len(radius))))


def random_step(
    seed: int, shape: tuple[int, int] = (20, 6)
) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-0.6, 0.6, (*shape, 2))
    displacement = rng.uniform(-0.5, 0.5, (*shape, 2))
    return position, displacement, rng.uniform(0.02, 0.1, shape)


def judge_random(seed: int) -> Contacts:
    position, displacement, radius = random_step(seed)
    everyone = np.ones(radius.shape, dtype=np.bool_)
    return straight(position, displacement, radius, everyone, ~everyone)


def test_robots_that_stand_apart_keep_their_gap() -> None:
    contacts = judge([[0.0, 0.0], [0.5, 0.0]], [[0.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(contacts.clearance, [[0.3, 0.3]], atol=1e-15)
    assert not contacts.touched.any()
    assert (contacts.fraction == 1.0).all()


def test_robots_that_swap_places_collide_inside_the_step() -> None:
    contacts = judge([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]])
    np.testing.assert_allclose(contacts.clearance, [[-0.2, -0.2]], atol=1e-15)
    np.testing.assert_allclose(contacts.fraction, [[0.4, 0.4]], atol=1e-15)
    assert contacts.num_pairs.tolist() == [1]


def test_robots_whose_paths_cross_at_different_times_do_not_collide() -> None:
    contacts = judge([[-0.5, 0.0], [0.0, -3.0]], [[1.0, 0.0], [0.0, 3.2]])
    assert not contacts.touched.any()
    assert (contacts.clearance > 0.0).all()


def test_passing_robot_is_closest_half_way() -> None:
    contacts = judge([[0.0, 0.0], [-1.0, 0.3]], [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_allclose(contacts.clearance, [[0.1, 0.1]], atol=1e-15)


def test_robots_that_move_alike_keep_their_gap() -> None:
    contacts = judge([[0.0, 0.0], [0.0, 0.25]], [[5.0, 7.0], [5.0, 7.0]])
    np.testing.assert_allclose(contacts.clearance, [[0.05, 0.05]], atol=1e-15)


def test_robots_may_start_touching_and_part() -> None:
    contacts = judge([[0.0, 0.0], [2 * RADIUS, 0.0]], [[-1.0, 0.0], [1.0, 0.0]])
    assert not contacts.touched.any()
    np.testing.assert_allclose(contacts.clearance, 0.0, atol=1e-15)


def test_robots_may_slide_along_each_other() -> None:
    contacts = judge([[0.0, 0.0], [2 * RADIUS, 0.0]], [[0.0, 0.1], [0.0, 0.1]])
    assert not contacts.touched.any()


def test_touching_robots_that_press_on_have_collided() -> None:
    contacts = judge([[0.0, 0.0], [2 * RADIUS, 0.0]], [[1e-6, 0.0], [0.0, 0.0]])
    assert contacts.touched.all()
    assert contacts.fraction.max() < 1e-8


def test_robots_on_one_spot_overlap_by_their_radii() -> None:
    contacts = judge([[0.3, 0.3], [0.3, 0.3]], [[0.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(contacts.clearance, -2 * RADIUS)
    np.testing.assert_array_equal(contacts.fraction, 0.0)
    assert contacts.touched.all()


@pytest.mark.parametrize("tiny", [5e-324, 1e-200, 1e-160])
def test_movement_too_small_to_square_is_judged_as_standing(tiny: float) -> None:
    contacts = judge([[0.0, 0.0], [0.5, 0.0]], [[tiny, 0.0], [0.0, -tiny]])
    np.testing.assert_allclose(contacts.clearance, 0.3, atol=1e-15)


def test_robot_alone_meets_nobody() -> None:
    contacts = judge([[0.0, 0.0]], [[1.0, 0.0]])
    assert contacts.clearance.tolist() == [[np.inf]]


def test_robots_without_a_body_are_met_by_nobody() -> None:
    contacts = judge([[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0]] * 2, present=np.array([[True, False]]))
    assert contacts.clearance.tolist() == [[np.inf, np.inf]]


def test_two_wrecks_are_judged_once_but_a_third_robot_hits_them() -> None:
    position = [[0.0, 0.0], [2 * RADIUS - 1e-3, 0.0], [1.0, 0.0]]
    wrecked = np.array([[True, True, False]])
    still = judge(position, [[0.0, 0.0]] * 3, wrecked=wrecked)
    assert still.num_pairs.tolist() == [0]
    hit = judge(position, [[0.0, 0.0], [0.0, 0.0], [-0.7, 0.0]], wrecked=wrecked)
    assert hit.num_pairs.tolist() == [1]
    assert hit.touched.tolist() == [[False, True, True]]


def test_a_light_early_contact_counts_beside_deep_late_ones() -> None:
    # Robot 0 runs deep into 1 and 2, which have grazed each other just before.
    position = [[-1.0, 0.0], [0.0, 0.102], [0.0, -0.102]]
    contacts = judge(position, [[2.0, 0.0], [0.0, -0.005], [0.0, 0.005]])
    assert contacts.num_pairs.tolist() == [3]
    np.testing.assert_allclose(contacts.fraction[0, 1:], 0.4, atol=1e-12)
    assert contacts.fraction[0, 0] > 0.4


@pytest.mark.parametrize("seed", range(4))
def test_every_pair_that_touches_is_counted_whatever_else_touches(seed: int) -> None:
    # Dense: light early contacts beside deep late ones.
    position, displacement, radius = random_step(seed, (40, 9))
    everyone = np.ones(radius.shape, dtype=np.bool_)
    contacts = straight(position, displacement, radius, everyone, ~everyone)
    everyone = everyone[:, :2]
    pairs = np.zeros(len(radius), dtype=np.int64)
    first = np.ones(radius.shape)
    for i in range(radius.shape[1]):
        for j in range(i):
            two = [i, j]
            of_two = straight(
                np.ascontiguousarray(position[:, two]),
                np.ascontiguousarray(displacement[:, two]),
                np.ascontiguousarray(radius[:, two]),
                everyone,
                ~everyone,
            )
            pairs += of_two.num_pairs
            first[:, two] = np.minimum(first[:, two], of_two.fraction)
    np.testing.assert_array_equal(contacts.num_pairs, pairs)
    np.testing.assert_allclose(contacts.fraction, first, atol=1e-12)
    assert pairs.max() > 4


@pytest.mark.parametrize("num_robots", [3, 60])
def test_a_horizon_hides_clearances_beyond_it_and_no_contact(num_robots: int) -> None:
    rng = np.random.default_rng(num_robots)
    # 60 robots lie in many cells, 3 in one.
    position = rng.uniform(-0.2, 0.2, (30, num_robots, 2)) * num_robots
    movement = Movement(rng.uniform(-0.5, 0.5, position.shape), np.zeros(position.shape[:2]), 1.0)
    everyone = np.ones(position.shape[:2], dtype=np.bool_)
    walls = WallMap.everywhere(rng.uniform(-3.0, 3.0, (40, 2, 2)), 30)
    bodies = Bodies(np.full(everyone.shape, RADIUS), everyone, ~everyone, walls)
    whole = find_contacts(position, movement, bodies)
    near = find_contacts(position, movement, bodies, horizon=0.1)
    for field in ("touched", "hit_wall", "fraction", "num_pairs"):
        np.testing.assert_array_equal(getattr(near, field), getattr(whole, field))
    for found, known in (
        (near.clearance, whole.clearance),
        (near.wall_clearance, whole.wall_clearance),
    ):
        np.testing.assert_allclose(found[known < 0.0], known[known < 0.0], atol=1e-12)
        assert (found >= known - 1e-12 - 0.05 * np.maximum(known, 0.0)).all()
    assert np.isinf(near.clearance).any() or num_robots > 3
    assert whole.touched.any()


def test_people_are_judged_against_robots_only() -> None:
    everyone = np.ones((1, 3), dtype=np.bool_)
    person = np.array([[True, True, False]])
    walls = WallMap.everywhere([[[0.0, -1.0], [0.0, 1.0]]], 1)
    bodies = Bodies(np.full((1, 3), RADIUS), everyone, ~everyone, walls, person)
    position = np.array([[[0.0, 0.0], [0.1, 0.0], [0.25, 0.0]]])
    contacts = find_contacts(position, Movement(np.zeros((1, 3, 2)), np.zeros((1, 3)), 1.0), bodies)
    assert contacts.touched.tolist() == [[False, True, True]]
    assert not contacts.hit_wall.any()
    assert contacts.num_pairs.tolist() == [1]


def test_worlds_do_not_meet() -> None:
    alone = np.zeros((3, 1, 2))
    flags = np.ones((3, 1), dtype=np.bool_)
    contacts = straight(alone, alone, np.ones((3, 1)), flags, ~flags)
    assert np.isinf(contacts.clearance).all()


@pytest.mark.parametrize("seed", range(3))
def test_closed_form_equals_ten_thousand_sub_steps(seed: int) -> None:
    position, displacement, radius = random_step(seed, (3, 5))
    everyone = np.ones(radius.shape, dtype=np.bool_)
    contacts = straight(position, displacement, radius, everyone, ~everyone)
    num_sub_steps = 10_000
    s = np.linspace(0.0, 1.0, num_sub_steps + 1)[:, np.newaxis, np.newaxis, np.newaxis]
    way = position + s * displacement
    itself = np.arange(radius.shape[1])
    gap = np.linalg.norm(way[:, :, :, np.newaxis] - way[:, :, np.newaxis], axis=-1)
    gap -= radius[:, :, np.newaxis] + radius[:, np.newaxis]
    gap[:, :, itself, itself] = np.inf
    sampled = gap.min(axis=(0, 3))
    # Between two samples a pair moves by at most half a sub-step's relative displacement, sqrt(2) in all.
    error = 0.5 * np.sqrt(2.0) * 2.0 / num_sub_steps
    assert (contacts.clearance <= sampled + 1e-12).all()
    assert (contacts.clearance >= sampled - error - COARSENESS * np.maximum(sampled, 0.0)).all()
    has_entered = (gap < -CONTACT_TOLERANCE).any(axis=3)
    first = np.where(has_entered.any(axis=0), has_entered.argmax(axis=0) / num_sub_steps, 1.0)
    surely = contacts.clearance < -error
    np.testing.assert_allclose(
        contacts.fraction[surely], first[surely], atol=2.0 / num_sub_steps, rtol=0.0
    )
    assert surely.any()


@pytest.mark.parametrize("seed", range(3))
def test_order_of_robots_does_not_matter(seed: int) -> None:
    position, displacement, radius = random_step(seed)
    everyone = np.ones(radius.shape, dtype=np.bool_)
    forward = judge_random(seed)
    backward = straight(
        np.ascontiguousarray(position[:, ::-1]),
        np.ascontiguousarray(displacement[:, ::-1]),
        np.ascontiguousarray(radius[:, ::-1]),
        everyone,
        ~everyone,
    )
    np.testing.assert_allclose(backward.clearance[:, ::-1], forward.clearance, atol=1e-15)
    np.testing.assert_array_equal(backward.touched[:, ::-1], forward.touched)
    np.testing.assert_array_equal(backward.num_pairs, forward.num_pairs)


@pytest.mark.parametrize("angle", [0.3, 1.7, 4.0])
def test_turning_and_moving_the_world_changes_nothing(angle: float) -> None:
    position, displacement, radius = random_step(5)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    everyone = np.ones(radius.shape, dtype=np.bool_)
    turned = straight(
        position @ turn.T + [3.0, -2.0], displacement @ turn.T, radius, everyone, ~everyone
    )
    before = judge_random(5)
    np.testing.assert_allclose(turned.clearance, before.clearance, atol=1e-14)
    np.testing.assert_array_equal(turned.touched, before.touched)


def test_robots_stopped_at_their_first_contact_touch_exactly() -> None:
    position, displacement, radius = random_step(1, (400, 2))
    everyone = np.ones(radius.shape, dtype=np.bool_)
    contacts = straight(position, displacement, radius, everyone, ~everyone)
    stopped = position + contacts.fraction[..., np.newaxis] * displacement
    distance = np.linalg.norm(stopped[:, 0] - stopped[:, 1], axis=1)
    started_apart = np.linalg.norm(position[:, 0] - position[:, 1], axis=1) > radius.sum(axis=1)
    hit = contacts.touched[:, 0] & started_apart
    assert hit.sum() > 20
    np.testing.assert_allclose(distance[hit], radius.sum(axis=1)[hit], atol=1e-12)


def judge_drives(
    seed: int, shape: tuple[int, int] = (20, 6)
) -> tuple[FloatArray, Movement, Contacts, FloatArray]:
    """Robots that turn, between three walls."""
    rng = np.random.default_rng(seed)
    position, displacement, radius = random_step(seed, shape)
    movement = Movement(displacement, rng.uniform(-3.0, 3.0, shape), 1.0)
    walls = rng.uniform(-1.0, 1.0, (3, 2, 2))
    everyone = np.ones(shape, dtype=np.bool_)
    bodies = Bodies(radius, everyone, ~everyone, WallMap.everywhere(walls, len(everyone)))
    return position, movement, find_contacts(position, movement, bodies), walls


@pytest.mark.parametrize("seed", range(2))
def test_certified_bound_on_arcs_equals_ten_thousand_sub_steps(seed: int) -> None:
    position, movement, contacts, walls = judge_drives(seed, (3, 5))
    radius = random_step(seed, (3, 5))[2]
    num_sub_steps = 10_000
    parts = np.linspace(0.0, 1.0, num_sub_steps + 1)
    way = np.stack([position + movement.after(np.full(radius.shape, part)) for part in parts])
    itself = np.arange(radius.shape[1])
    gap = np.linalg.norm(way[:, :, :, np.newaxis] - way[:, :, np.newaxis], axis=-1)
    gap -= radius[:, :, np.newaxis] + radius[:, np.newaxis]
    gap[:, :, itself, itself] = np.inf
    error = 2.0 * np.abs(movement.displacement).sum(axis=-1).max() / num_sub_steps
    sampled = gap.min(axis=(0, 3))
    assert (contacts.clearance <= sampled + 1e-12).all()
    assert (contacts.clearance >= sampled - error - COARSENESS * np.maximum(sampled, 0.0)).all()
    to_wall = np.full(radius.shape, np.inf)
    for a, b in walls:
        along = np.clip((way - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away = np.linalg.norm(way - a - along[..., np.newaxis] * (b - a), axis=-1)
        to_wall = np.minimum(to_wall, away.min(axis=0) - radius)
    assert (contacts.wall_clearance <= to_wall + 1e-12).all()
    lowest = to_wall - error - COARSENESS * np.maximum(to_wall, 0.0)
    assert (contacts.wall_clearance >= lowest).all()
    assert contacts.hit_wall.any()
    assert contacts.touched.any()


def test_drives_stopped_at_their_first_contact_touch_nothing() -> None:
    position, movement, contacts, walls = judge_drives(3, (300, 2))
    radius = random_step(3, (300, 2))[2]
    everyone = np.ones(radius.shape, dtype=np.bool_)
    bodies = Bodies(radius, everyone, ~everyone, WallMap.everywhere(walls, len(everyone)))
    at_rest = Movement(np.zeros_like(position), np.zeros(radius.shape), 1.0)
    before = find_contacts(position, at_rest, bodies)
    apart = ~(before.touched | before.hit_wall).any(axis=1)
    stopped = position + movement.after(contacts.fraction)
    after = find_contacts(stopped, at_rest, bodies)
    # A robot that goes on while the other is stopped by a wall may run into it: those touched nothing.
    fair = apart & (contacts.fraction[:, 0] == contacts.fraction[:, 1])
    assert (after.clearance[fair] > -1e-7).all()
    assert (after.wall_clearance[apart] > -1e-7).all()
    assert (contacts.hit_wall[apart] & (contacts.fraction[apart] > 0.0)).sum() > 5


def test_robot_that_drives_into_a_wall_stops_at_it() -> None:
    everyone = np.ones((1, 1), dtype=np.bool_)
    walls = np.array([[[1.0, -1.0], [1.0, 1.0]]])
    bodies = Bodies(
        np.full((1, 1), RADIUS), everyone, ~everyone, WallMap.everywhere(walls, len(everyone))
    )
    movement = Movement(np.array([[[1.8, 0.0]]]), np.zeros((1, 1)), 1.0)
    contacts = find_contacts(np.zeros((1, 1, 2)), movement, bodies)
    assert contacts.hit_wall.tolist() == [[True]]
    np.testing.assert_allclose(contacts.wall_clearance, -RADIUS)
    np.testing.assert_allclose(contacts.fraction, 0.5)
    assert np.isinf(contacts.clearance).all()
    wreck = Bodies(bodies.radius, everyone, everyone, WallMap.everywhere(walls, 1))
    assert not find_contacts(np.zeros((1, 1, 2)), movement, wreck).hit_wall.any()


def test_robot_may_slide_along_a_wall_that_it_touches() -> None:
    everyone = np.ones((1, 1), dtype=np.bool_)
    walls = np.array([[[RADIUS, -1.0], [RADIUS, 1.0]]])
    bodies = Bodies(
        np.full((1, 1), RADIUS), everyone, ~everyone, WallMap.everywhere(walls, len(everyone))
    )
    movement = Movement(np.array([[[0.0, 0.3]]]), np.zeros((1, 1)), 1.0)
    contacts = find_contacts(np.zeros((1, 1, 2)), movement, bodies)
    assert not contacts.hit_wall.any()
    np.testing.assert_allclose(contacts.wall_clearance, 0.0, atol=1e-9)


def test_start_clearances_are_those_of_a_step_of_no_movement() -> None:
    rng = np.random.default_rng(4)
    world = World.empty(6, Fleet.of(5, radius=rng.uniform(0.05, 0.2, 5)))
    world.present[...] = rng.uniform(size=(6, 5)) < 0.8
    world.position[...] = rng.uniform(-0.4, 0.4, (6, 5, 2))
    world.walls.replace({w: rng.uniform(-2.0, 2.0, (w, 2, 2)) for w in range(6)})
    at_rest = Movement(np.zeros_like(world.position), np.zeros((6, 5)), 1.0)
    bodies = Bodies(world.radius, world.present, world.nobody, world.walls)
    contacts = find_contacts(world.position, at_rest, bodies)
    to_robot, to_wall = start_clearances(world, [1, 4, 5])
    np.testing.assert_allclose(to_robot, contacts.clearance[[1, 4, 5]], atol=1e-12)
    np.testing.assert_allclose(to_wall, contacts.wall_clearance[[1, 4, 5]], atol=1e-12)
    assert (to_robot < 0.0).any()
    assert np.isinf(to_wall[~world.present[[1, 4, 5]]]).all()

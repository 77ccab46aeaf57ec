"""Separation in space: budgets along the line of centres, and that pairs which keep them never touch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.closest_approach import closest_approach, pairs_within
from safefilter.constraints.separation import SAFETY_MARGIN
from safefilter.testing.space_strategies import crowded_in_space, lifted, scenes_in_space
from safefilter.testing.strategies import scenes

DT = 0.2
V_MAX = 2.0


def rows_of(scene: sf.Scene, separation: sf.Separation | None = None) -> sf.HalfSpaces:
    index = np.flatnonzero(scene.cooperative)
    safety_filter = sf.SafetyFilter(
        [separation or sf.Separation(DT)], sf.Holonomic(V_MAX, dimension=3)
    )
    return safety_filter.half_spaces(scene, np.zeros((len(index), 3)), index)


def test_by_hand() -> None:
    # 7 m apart along (2, 3, 6); 1 m free; priorities 3 to 1; both could cover more than the gap in a step of 1 s.
    scene = sf.Scene.from_world([[0, 0, 0], [2, 3, 6]], np.zeros((2, 3)), 3.0, priority=[3.0, 1.0])
    rows = sf.Separation(1.0, safety_margin=0.0).half_spaces(scene, np.zeros((2, 3)), np.arange(2))
    e = np.array([2.0, 3.0, 6.0]) / 7.0
    np.testing.assert_allclose(rows.normals[:, 0], [-e, e], rtol=1e-15)
    np.testing.assert_allclose(rows.offsets[:, 0], [-0.75, -0.25], rtol=1e-15)
    assert rows.hard.all()


def test_a_neighbour_that_does_not_cooperate_is_credited_with_its_approach() -> None:
    scene = sf.Scene.from_world(
        np.array([[0, 0, 0], [0, 0, 3]]),
        np.array([[0, 0, 0], [5, 5, -0.5]]),
        1.0,
        cooperative=[True, False],
    )
    own = np.zeros((1, 3)), np.arange(1)
    rows = sf.Separation(1.0, safety_margin=0.0).half_spaces(scene, *own)
    assert rows.offsets[0, 0] == pytest.approx(-0.5)
    faster = sf.Separation(1.0, safety_margin=0.0, passive_speed=0.8).half_spaces(scene, *own)
    assert faster.offsets[0, 0] == pytest.approx(-0.2)


def test_robots_in_one_place_may_go_anywhere_but_along_one_axis_the_same_way() -> None:
    scene = sf.Scene.from_world(np.zeros((2, 3)), np.zeros((2, 3)), 0.5)
    rows = sf.Separation(DT).half_spaces(scene, np.zeros((2, 3)), np.arange(2))
    assert rows.normals[:, 0].tolist() == [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    assert rows.offsets[:, 0].tolist() == [0.0, 0.0]


@given(scene=scenes_in_space())
def test_standing_still_keeps_every_row(scene: sf.Scene) -> None:
    rows = rows_of(scene)
    assert (rows.offsets[rows.present & rows.hard] <= 0.0).all()


@given(scene=crowded_in_space(), seed=st.integers(0, 1000))
def test_whoever_keeps_the_rows_touches_nobody(scene: sf.Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rows_of(scene)
    cooperative = np.flatnonzero(scene.cooperative)
    velocity = np.zeros((scene.num_robots, 3))
    wanted: FloatArray = rng.normal(size=(len(cooperative), 3))
    wanted *= V_MAX / np.linalg.norm(wanted, axis=1)[:, None]
    # As far as each can go that way: along a ray every row gives a limit.
    along = np.einsum("bmd,bd->bm", rows.normals, wanted)
    is_against = rows.present & (along < rows.offsets)
    limits = np.divide(rows.offsets, along, out=np.ones_like(along), where=is_against)
    velocity[cooperative] = wanted * limits.min(axis=1)[:, None]
    pairs = pairs_within(scene.world)
    judged = scene.cooperative[pairs.first] & scene.cooperative[pairs.second]
    approach = closest_approach(scene.position, velocity * DT, scene.radius, pairs)
    floor = np.minimum(approach.start, SAFETY_MARGIN) - 1e-9
    assert (approach.least >= floor)[judged].all()


@given(scene=scenes())
def test_robots_in_a_plane_of_space_get_the_rows_of_the_plane(scene: sf.Scene) -> None:
    space = lifted(scene, height=2.0)
    everyone = np.arange(scene.num_robots)
    separation = sf.Separation(DT, passive_speed=0.3)
    flat = separation.half_spaces(scene, np.zeros((len(everyone), 2)), everyone)
    rows = separation.half_spaces(space, np.zeros((len(everyone), 3)), everyone)
    assert (rows.labels == flat.labels).all()
    assert (rows.normals[..., 2] == 0.0).all()
    np.testing.assert_allclose(rows.normals[..., :2], flat.normals, rtol=1e-14)
    np.testing.assert_allclose(rows.offsets, flat.offsets, rtol=1e-13, atol=1e-14)


@given(scene=scenes_in_space(st.integers(2, 8)))
def test_whoever_is_left_out_cannot_be_met(scene: sf.Scene) -> None:
    rows, speed = rows_of(scene), V_MAX * (1.0 + 1e-6)
    for row, robot in enumerate(np.flatnonzero(scene.cooperative)):
        told = rows.labels[row, rows.present[row] & (rows.labels[row, :, 0] == 1), 1].tolist()
        for other in np.flatnonzero(scene.cooperative).tolist():
            if other in {robot, *told}:
                continue
            p = scene.position[other] - scene.position[robot]
            free = float(np.linalg.norm(p) - scene.radius[robot] - scene.radius[other])
            share = scene.priority[robot] / (scene.priority[robot] + scene.priority[other])
            assert speed * DT <= max(share * free, free - speed * DT) + 1e-9


def test_a_scene_that_sees_too_little_is_refused() -> None:
    scene = sf.Scene.from_world(np.eye(3), 0.1 * np.eye(3), 0.2, reach=1.0)
    with pytest.raises(sf.errors.OutOfRange) as caught:
        rows_of(scene)
    assert str(caught.value) == (
        "reach: hard rows need every neighbour within 1.2 m, but the scene sees 1 m; "
        "pass a larger reach= to Scene.from_world"
    )


def test_robots_that_do_not_cooperate_need_a_reach_for_their_speed_in_space() -> None:
    scene = sf.Scene.from_world(
        [[0, 0, 0], [0, 0, 9]], [[0, 0, 0], [2, 3, 6]], 0.5, cooperative=[True, False]
    )
    limit = np.array([1.0, 1.0])
    # Two radii, and a step of what each may cover: 1 and 7 m/s.
    assert sf.Separation(0.5, 0.0).required_reach(scene, limit) == pytest.approx(1.0 + 0.5 * 8.0)


def test_bounds_on_errors_are_refused_and_not_forgotten() -> None:
    careful = sf.Separation(DT, uncertainty=sf.Uncertainty(position_error=0.01))
    scene = sf.Scene.from_world(np.eye(3), np.zeros((3, 3)), 0.1)
    message = "uncertainty: what errors ask for is known for robots in the plane only; drop it for robots in space"
    with pytest.raises(sf.errors.InvalidInput) as caught:
        rows_of(scene, careful)
    assert str(caught.value) == message
    with pytest.raises(sf.errors.InvalidInput) as caught:
        careful.half_spaces(scene, np.zeros((3, 3)), np.arange(3))
    assert str(caught.value) == message

"""Boxes hold their walls, and whoever passes one over leaves nothing out that matters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter import wall_boxes
from safefilter.arrays import frozen
from safefilter.constraints.walls import to_closest_point
from safefilter.outlines import OwnWalls
from safefilter.wall_boxes import FEW_WALLS, NO_BOXES, RUN, beyond, boxes_for, is_box_far, is_far

MANY = FEW_WALLS + 1


def random_walls(seed: int, number: int, size: float = 1.0) -> np.ndarray:
    """In the form of `Scene.walls`: along a way, as maps list them, some of them points."""
    rng = np.random.default_rng(seed)
    start = np.cumsum(rng.normal(size=(number, 2)), axis=0)
    end = start + size * rng.normal(size=(number, 2)) * (rng.random((number, 1)) < 0.8)
    return np.column_stack([start, end, rng.choice([0.0, 0.2], number)])


def test_boxes_by_hand() -> None:
    walls = np.zeros((MANY, 5))
    walls[:, 0], walls[:, 2] = np.arange(MANY), np.arange(MANY) + 0.5
    walls[1, 3], walls[2, 4], walls[RUN, 1] = 3.0, 0.2, -1.0
    boxes = boxes_for(walls, MANY)
    assert boxes.shape == (3, 5)
    assert boxes[0].tolist() == [0.0, 0.0, RUN - 0.5, 3.0, 0.2]
    assert boxes[1].tolist() == [RUN, -1.0, 2 * RUN - 0.5, 0.0, 0.0]
    assert boxes[2].tolist() == [2 * RUN, 0.0, 2 * RUN + 0.5, 0.0, 0.0]
    assert not boxes.flags.writeable


def test_few_walls_have_none() -> None:
    assert boxes_for(np.zeros((FEW_WALLS, 5)), FEW_WALLS) is NO_BOXES
    assert boxes_for(np.zeros((100, 5)), FEW_WALLS) is NO_BOXES
    assert OwnWalls.none(3).boxes is NO_BOXES


@pytest.mark.parametrize(
    ("at", "expected"), [(-2.0, 3.0), (1.0, 0.0), (1.5, 0.0), (4.0, 0.0), (4.5, 0.5)]
)
def test_how_far_out_of_a_range(at: float, expected: float) -> None:
    assert beyond(1.0, 4.0, at) == expected


def test_a_box_is_far_from_where_its_corner_is() -> None:
    box = (1.0, 1.0, 3.0, 2.0)
    assert is_box_far(*box, -2.0, -3.0, 4.9)  # 3-4-5 to the corner at (1, 1)
    assert not is_box_far(*box, -2.0, -3.0, 5.0)
    assert not is_box_far(*box, 2.0, 1.5, 0.0)  # inside


@given(
    seed=st.integers(0, 2**32),
    number=st.integers(1, 40),
    place=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
    reach=st.floats(0.0, 6.0),
)
def test_whoever_passes_a_box_over_would_leave_out_each_wall_in_it(
    seed: int, number: int, place: tuple[float, float], reach: float
) -> None:
    walls = random_walls(seed, number)
    for b, (left, bottom, right, top, most) in enumerate(boxes_for(walls, MANY)):
        inside = walls[b * RUN : (b + 1) * RUN]
        assert left == inside[:, [0, 2]].min()
        assert right == inside[:, [0, 2]].max()
        assert bottom == inside[:, [1, 3]].min()
        assert top == inside[:, [1, 3]].max()
        assert most == inside[:, 4].max()
        if is_box_far(left, bottom, right, top, *place, reach + most):
            for a_x, a_y, b_x, b_y, margin in inside.tolist():
                closest = to_closest_point(a_x, a_y, b_x, b_y, *place)
                assert is_far(*closest, reach + margin)


def test_the_margin_of_a_wall_reaches_out_of_its_box() -> None:
    # 0.8 m away, with a margin of 0.2 m of their own; rows reach 0.3 m/s for 2 s, and a radius of 0.1 m.
    walls = np.tile([0.8, 0.0, 0.8, 0.0, 0.2], (MANY, 1))
    own = OwnWalls(frozen(walls), frozen(np.array([[0, MANY]])), MANY)
    scene = sf.Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1, own_walls=own)
    safety = sf.SafetyFilter([sf.StaticObstacles(2.0)], sf.Holonomic(0.3))
    rows = safety.half_spaces(scene, np.zeros((1, 2)))
    assert (rows.labels[0, rows.present[0], 0] == 1).sum() == MANY


@given(
    seed=st.integers(0, 2**32),
    num_shared=st.integers(0, 40),
    num_own=st.integers(0, 40),
    scale=st.sampled_from((0.2, 1.0)),
)
def test_boxes_change_no_decision(seed: int, num_shared: int, num_own: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    shared, own = random_walls(seed, num_shared, 0.3), random_walls(seed + 1, num_own, 0.3)
    first = rng.integers(0, num_own + 1, 5)
    ranges = np.stack([first, rng.integers(first, num_own + 1)], axis=1)
    position, velocity = rng.normal(size=(5, 2)), 0.2 * rng.normal(size=(5, 2))
    safety = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(2.0)], sf.Holonomic(0.3)
    )

    def made() -> sf.Scene:
        return sf.Scene.from_world(
            position,
            velocity,
            0.1,
            walls=scale * shared[:, :4].reshape(-1, 2, 2),
            # With margins, as walls from scans have them.
            own_walls=OwnWalls(
                frozen(scale * own), frozen(ranges), int(np.ptp(ranges, axis=1).max())
            ),
        )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wall_boxes, "FEW_WALLS", 1000)
        plain = made()
    boxed, action = made(), 0.3 * rng.normal(size=(5, 2))
    assert len(plain.wall_boxes) == 0
    assert (len(boxed.wall_boxes) > 0) == (boxed.most_walls > FEW_WALLS)
    one, other = safety.decide(plain, action), safety.decide(boxed, action)
    for name in ("action", "case", "active", "multipliers", "certified"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    rows, same = safety.half_spaces(plain, action), safety.half_spaces(boxed, action)
    np.testing.assert_array_equal(rows.present.sum(axis=1), same.present.sum(axis=1))
    for k in range(5):
        for name in ("normals", "offsets", "labels", "hard"):
            np.testing.assert_array_equal(
                getattr(rows, name)[k][rows.present[k]], getattr(same, name)[k][same.present[k]]
            )

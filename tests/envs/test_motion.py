import math

import numpy as np
import pytest

from envs.motion import Motion
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, ShapeError

ON = np.ones((1, 1), dtype=np.bool_)
STILL = np.zeros((1, 1, 2))


def drive(way: FloatArray, actions: FloatArray | None = None) -> Motion:
    """One robot along a way, shape (T, 2)."""
    motion = Motion.begin(way[np.newaxis, :1])
    for step in range(1, len(way)):
        action = np.zeros(2) if actions is None else actions[step - 1]
        motion.record(way[np.newaxis, [step]], action[np.newaxis, np.newaxis], ON)
    return motion


def test_straight_way_has_no_detour_and_a_corner_has_its_length() -> None:
    straight = drive(np.linspace([0, 0], [3, 4], 26))
    assert straight.path_length.item() == pytest.approx(5.0)
    assert straight.detour().item() == pytest.approx(1.0)
    corner = drive(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]))
    assert corner.detour().item() == pytest.approx(math.sqrt(2.0))
    assert corner.detour_of(np.array([[1.6]])).item() == pytest.approx(2.0 / 1.6)


def test_detour_is_never_below_one() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        assert drive(rng.normal(size=(20, 2)).cumsum(axis=0)).detour().item() >= 1.0 - 1e-12


def test_detour_knows_no_axes_and_no_scale() -> None:
    way = np.random.default_rng(1).normal(size=(20, 2)).cumsum(axis=0)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    expected = drive(way).detour()
    for changed in (way @ turn + 5.0, 3.0 * way, way * [1.0, -1.0], way[::-1]):
        np.testing.assert_allclose(drive(changed).detour(), expected)


def test_who_stayed_has_no_detour() -> None:
    assert math.isnan(drive(np.zeros((3, 2))).detour().item())


def test_action_variation_by_hand() -> None:
    actions = np.array([[0.2, 0.0], [0.1, 2.5], [0.2, 2.5]])
    motion = drive(np.zeros((4, 2)), actions)
    # v changes by 0.5 and 0.5 of 0.2 m/s, w by 1 and 0 of 2.5 rad/s; the first action is no change.
    scale = np.array([0.2, 2.5])
    assert motion.action_variation(scale).item() == pytest.approx((1.0 + 1.0) / 2 / 2)
    mirrored = drive(np.zeros((4, 2)), actions * [1.0, -1.0])
    np.testing.assert_allclose(mirrored.action_variation(scale), motion.action_variation(scale))


def test_one_action_has_no_variation() -> None:
    for steps in (1, 2):
        assert math.isnan(drive(np.zeros((steps, 2))).action_variation(np.ones(2)).item())


def test_nothing_is_added_once_a_robot_has_finished() -> None:
    motion = drive(np.array([[0.0, 0.0], [1.0, 0.0]]))
    motion.record(np.array([[[0.5, 0.0]]]), np.ones((1, 1, 2)), ~ON)
    assert motion.path_length.item() == 1.0
    assert motion.detour().item() == 1.0
    assert motion.steps.item() == 1
    assert motion.action_change.sum() == 0.0


def test_who_starts_anew_elsewhere_has_not_driven_there() -> None:
    motion = drive(np.array([[0.0, 0.0], [1.0, 0.0]]))
    motion.restart(np.array([[[0.0, 5.0]]]), ON)
    assert motion.detour().item() == 1.0
    motion.record(np.array([[[0.0, 6.0]]]), STILL, ON)
    motion.record(np.array([[[1.0, 6.0]]]), STILL, ON)
    assert motion.path_length.item() == 3.0
    assert motion.detour().item() == pytest.approx(3.0 / (1.0 + math.sqrt(2.0)))


def test_start_is_a_copy() -> None:
    position = np.zeros((1, 1, 2))
    motion = Motion.begin(position)
    position += 1.0
    motion.record(position, STILL, ON)
    assert motion.path_length.item() == pytest.approx(math.sqrt(2.0))
    assert motion.start.tolist() == [[[0.0, 0.0]]]


def test_values_that_cannot_be_used_are_refused() -> None:
    motion = Motion.begin(STILL)
    nan = np.full((1, 1, 2), np.nan)
    with pytest.raises(NotFinite, match="position"):
        motion.record(nan, STILL, ON)
    with pytest.raises(NotFinite, match="action"):
        motion.record(STILL, nan, ON)
    with pytest.raises(ShapeError, match="under_way"):
        motion.record(STILL, STILL, ON[0])
    with pytest.raises(NotFinite, match="position"):
        Motion.begin(nan)

import math

import numpy as np
import pytest

from envs.motion import Motion, RotateInPlace
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, OutOfRange, ShapeError

DT = 0.2
ON = np.ones((1, 1), dtype=np.bool_)


def drive(way: FloatArray, heading: FloatArray, actions: FloatArray | None = None) -> Motion:
    """One robot along a way, shape (T, 2), with headings, shape (T,)."""
    motion = Motion.begin(way[np.newaxis, :1], heading[np.newaxis, :1])
    for step in range(1, len(way)):
        action = np.zeros(2) if actions is None else actions[step - 1]
        motion.record(
            way[np.newaxis, [step]],
            heading[np.newaxis, [step]],
            action[np.newaxis, np.newaxis],
            ON,
            DT,
        )
    return motion


def spinning(num_steps: int, rate: float) -> Motion:
    return drive(np.zeros((num_steps + 1, 2)), rate * DT * np.arange(num_steps + 1.0))


def test_straight_way_has_no_detour_and_a_square_has_its_length() -> None:
    straight = drive(np.linspace([0, 0], [3, 4], 26), np.zeros(26))
    assert straight.path_length.item() == pytest.approx(5.0)
    assert straight.detour().item() == pytest.approx(1.0)
    corner = drive(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), np.zeros(3))
    assert corner.detour().item() == pytest.approx(math.sqrt(2.0))
    assert corner.detour_of(np.array([[1.6]])).item() == pytest.approx(2.0 / 1.6)


def test_detour_is_never_below_one() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        motion = drive(rng.normal(size=(20, 2)).cumsum(axis=0), np.zeros(20))
        assert motion.detour().item() >= 1.0 - 1e-12


def test_detour_knows_no_axes_and_no_scale() -> None:
    way = np.random.default_rng(1).normal(size=(20, 2)).cumsum(axis=0)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    expected = drive(way, np.zeros(20)).detour()
    for changed in (way @ turn + 5.0, 3.0 * way, way * [1.0, -1.0], way[::-1]):
        np.testing.assert_allclose(drive(changed, np.zeros(20)).detour(), expected)


def test_who_stayed_has_no_detour() -> None:
    assert math.isnan(spinning(3, 1.0).detour().item())


def test_spinning_counts_once_long_enough_and_turned_enough() -> None:
    assert spinning(25, 2.5).rotates_in_place().item()  # 5 s, two turns
    assert not spinning(24, 2.5).rotates_in_place().item()
    assert not spinning(25, 1.2).rotates_in_place().item()  # 6 rad


def test_left_and_right_turns_add_up() -> None:
    heading = 0.4 * (np.arange(40.0) % 2)
    assert drive(np.zeros((40, 2)), heading).rotates_in_place().item()


def test_standing_still_and_driving_in_circles_are_not_spinning() -> None:
    assert not spinning(100, 0.0).rotates_in_place().item()
    angle = np.arange(100.0) * 0.5
    circle = 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert not drive(circle, angle).rotates_in_place().item()


def test_who_drives_on_is_not_spinning_any_more() -> None:
    way = np.concatenate([np.zeros((40, 2)), np.linspace([0, 0], [0.5, 0], 10)])
    heading = np.concatenate([0.5 * np.arange(40), np.full(10, 19.5)])
    assert drive(way[:40], heading[:40]).rotates_in_place().item()
    assert not drive(way, heading).rotates_in_place().item()


def test_heading_wraps() -> None:
    wrapped = np.angle(np.exp(1j * 0.5 * np.arange(30)))
    assert drive(np.zeros((30, 2)), wrapped).turned_there.item() == pytest.approx(0.5 * 29)


def test_rule_can_be_another() -> None:
    heading = np.linspace(0, 1, 6)[np.newaxis]
    motion = Motion.begin(
        np.zeros((1, 1, 2)), heading[:, :1], rotate_in_place=RotateInPlace(0.1, 1.0, 0.9)
    )
    for step in range(1, 6):
        motion.record(np.zeros((1, 1, 2)), heading[:, [step]], np.zeros((1, 1, 2)), ON, DT)
    assert motion.rotates_in_place().item()


def test_action_variation_by_hand() -> None:
    actions = np.array([[0.2, 0.0], [0.1, 2.5], [0.2, 2.5]])
    motion = drive(np.zeros((4, 2)), np.zeros(4), actions)
    # v changes by 0.5 and 0.5 of 0.2 m/s, w by 1 and 0 of 2.5 rad/s; the first action is no change.
    scale = np.array([0.2, 2.5])
    assert motion.action_variation(scale).item() == pytest.approx((1.0 + 1.0) / 2 / 2)
    mirrored = drive(np.zeros((4, 2)), np.zeros(4), actions * [1.0, -1.0])
    np.testing.assert_allclose(mirrored.action_variation(scale), motion.action_variation(scale))


def test_one_action_has_no_variation() -> None:
    for steps in (1, 2):
        motion = drive(np.zeros((steps, 2)), np.zeros(steps))
        assert math.isnan(motion.action_variation(np.ones(2)).item())


def test_nothing_is_added_once_a_robot_has_finished() -> None:
    motion = drive(np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros(2))
    pushed = np.array([[[0.5, 0.0]]])
    motion.record(pushed, np.ones((1, 1)), np.ones((1, 1, 2)), ~ON, DT)
    assert motion.path_length.item() == 1.0
    assert motion.detour().item() == 1.0
    assert motion.steps.item() == 1
    assert motion.action_change.sum() == 0.0
    assert motion.turned_there.item() == 0.0


def test_start_is_a_copy() -> None:
    position = np.zeros((1, 1, 2))
    motion = Motion.begin(position, np.zeros((1, 1)))
    position += 1.0
    motion.record(position, np.zeros((1, 1)), np.zeros((1, 1, 2)), ON, DT)
    assert motion.path_length.item() == pytest.approx(math.sqrt(2.0))
    assert motion.start.tolist() == [[[0.0, 0.0]]]


def test_values_that_cannot_be_used_are_refused() -> None:
    motion = Motion.begin(np.zeros((1, 1, 2)), np.zeros((1, 1)))
    good = (np.zeros((1, 1, 2)), np.zeros((1, 1)), np.zeros((1, 1, 2)), ON, DT)
    for place, name in enumerate(("position", "heading", "action")):
        bad = [*good]
        bad[place] = np.full_like(np.asarray(good[place]), np.nan)
        with pytest.raises(NotFinite, match=name):
            motion.record(*bad)  # type: ignore[arg-type]  # a list of mixed kinds
    with pytest.raises(ShapeError, match="under_way"):
        motion.record(*good[:3], ON[0], DT)
    with pytest.raises(NotFinite, match="position"):
        Motion.begin(np.full((1, 1, 2), np.nan), np.zeros((1, 1)))
    with pytest.raises(OutOfRange, match="angle"):
        RotateInPlace(angle=0.0)

"""The plane in which two robots meet: two unit vectors, and both robots find the same one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.constraints.encounter_plane import (
    ALONG_ANGLE,
    Meeting,
    find_plane,
    make_meeting,
    turn_left,
)
from safefilter.jit import kernel

coordinates = st.floats(-10.0, 10.0) | st.integers(-3, 3).map(float)
triples = st.tuples(coordinates, coordinates, coordinates)
Triple = tuple[float, float, float]


@kernel
def plane_of(meeting: Meeting, tie: float) -> tuple[float, float, float]:
    return find_plane(meeting, tie)


def met(position: Triple, velocity: Triple) -> Meeting:
    size = len(position)
    scratch = np.full((3, size), math.nan)
    return Meeting(np.array(position), np.array(velocity), *scratch)


def test_by_hand() -> None:
    meeting = met((0.0, 0.0, 2.0), (3.0, 4.0, -1.0))
    assert plane_of(meeting, 1.0) == (2.0, -1.0, 5.0)
    assert meeting.first.tolist() == [0.0, 0.0, 1.0]
    np.testing.assert_allclose(meeting.second, [0.6, 0.8, 0.0], atol=1e-16)


@given(position=triples, velocity=triples, tie=st.sampled_from((1.0, -1.0)))
@example(position=(1.0, 2.0, 3.0), velocity=(1.0 + 1e-11, 2.0, 3.0), tie=1.0)
@example(position=(1e-160, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), tie=-1.0)
@example(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 1.0), tie=1.0)
def test_it_holds_both_vectors_and_nothing_gets_lost(
    position: Triple, velocity: Triple, tie: float
) -> None:
    meeting = met(position, velocity)
    distance, along, across = plane_of(meeting, tie)
    first, second = meeting.first, meeting.second
    assert float(first @ first) == pytest.approx(1.0, abs=1e-14)
    assert float(second @ second) == pytest.approx(1.0, abs=1e-14)
    assert abs(float(first @ second)) <= 1e-14
    assert distance >= 0.0
    assert across >= 0.0
    scale = 1.0 + math.hypot(*velocity)
    np.testing.assert_allclose(distance * first, position, atol=1e-13)
    np.testing.assert_allclose(along * first + across * second, velocity, atol=1e-11 * scale)


@given(position=triples, velocity=triples)
@example(position=(1.0, 0.0, 0.0), velocity=(2.0, 0.0, 0.0))
@example(position=(0.0, 0.0, 1.0), velocity=(0.0, 0.0, -1.0))
@example(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0))
def test_the_other_robot_finds_the_same_plane_the_other_way_round(
    position: Triple, velocity: Triple
) -> None:
    own = met(position, velocity)
    other = met(
        (-position[0], -position[1], -position[2]), (-velocity[0], -velocity[1], -velocity[2])
    )
    assert plane_of(own, 1.0) == plane_of(other, -1.0)
    assert (own.first == -other.first).all()
    assert (own.second == -other.second).all()


def test_a_velocity_along_the_line_of_centres_names_no_side() -> None:
    # What is left of it across is rounding.
    meeting = met((1.0, 1.0, 0.0), (0.3, 0.3 * (1.0 + 0.5 * ALONG_ANGLE), 0.0))
    assert plane_of(meeting, 1.0)[2] == 0.0
    np.testing.assert_allclose(meeting.second, [-math.sqrt(0.5), math.sqrt(0.5), 0.0])


@pytest.mark.parametrize(
    ("first", "left"),
    [
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        ((0.6, -0.8, 0.0), (0.8, 0.6, 0.0)),
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
        ((0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)),
        ((0.36, 0.48, 0.8), (-0.8, 0.6, 0.0)),
    ],
)
def test_left_is_level_and_across(first: Triple, left: Triple) -> None:
    second = np.empty(3)
    turn_left(np.array(first), second)
    np.testing.assert_allclose(second, left, atol=1e-15)


@given(angle=st.floats(0.0, 6.3), v_x=coordinates, v_y=coordinates)
def test_in_the_plane_it_is_the_plane(angle: float, v_x: float, v_y: float) -> None:
    position = math.cos(angle), math.sin(angle)
    velocity = np.array([v_x, v_y])
    meeting = Meeting(np.array(position), velocity, *np.empty((3, 2)))
    distance, along, across = plane_of(meeting, 1.0)
    assert distance == pytest.approx(1.0)
    found: FloatArray = along * meeting.first + across * meeting.second
    np.testing.assert_allclose(found, velocity, atol=1e-10)


def test_room_is_of_the_size_asked_for() -> None:
    assert [len(part) for part in make_meeting(3)] == [3] * 5

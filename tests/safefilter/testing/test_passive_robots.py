"""Robots that do not cooperate move by what the guarantee credits them with, and no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.closest_approach import pairs_within
from safefilter.testing.passive_robots import passive_velocity
from safefilter.testing.strategies import actions, scenes

DT = 0.2


@given(st.data(), scenes(cooperative=st.just(False)), st.sampled_from([0.0, 0.3]))
def test_robots_that_do_not_cooperate_keep_to_what_they_are_credited_with(
    data: st.DataObject, scene: sf.Scene, passive_speed: float
) -> None:
    wanted = data.draw(actions(scene))
    pairs = pairs_within(scene.world)
    velocity = passive_velocity(scene, wanted, pairs, DT, passive_speed)
    # Robot 0 is the only one that cooperates.
    offset = scene.position[0] - scene.position[1:]
    distance = np.hypot(*offset.T)
    towards = offset / distance[:, None]
    gap = np.maximum(distance - scene.radius[0] - scene.radius[1:], 0.0)
    credit = np.maximum(along(towards, scene.velocity[1:]), passive_speed) * DT
    advance = along(towards, velocity[1:]) * DT
    assert (advance <= np.minimum(np.maximum(credit, 0.0), gap) + 1e-12).all()


def along(direction: FloatArray, velocity: FloatArray) -> FloatArray:
    return np.asarray((direction * velocity).sum(axis=1))


def test_a_robot_that_does_not_cooperate_moves_on_as_seen() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [2.0, 0.0]],
        [[0.0, 0.0], [-1.0, 0.0]],
        0.3,
        cooperative=[True, False],
    )
    pairs = pairs_within(scene.world)
    # It was seen to come at 1 m/s: twice that is not credited; going sideways is free.
    for wanted, expected in (
        ([-2.0, 0.0], [-1.0, 0.0]),
        ([0.0, 3.0], [0.0, 3.0]),
        ([0.0, 0.0], [-1.0, 0.0]),
    ):
        both = np.array([[0.0, 0.0], wanted])
        assert passive_velocity(scene, both, pairs, DT, 0.0)[1].tolist() == expected


def test_a_robot_that_does_not_cooperate_stops_at_contact() -> None:
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [0.7, 0.0]],
        [[0.0, 0.0], [-1.0, 0.0]],
        0.3,
        cooperative=[True, False],
    )
    velocity = passive_velocity(scene, scene.velocity, pairs_within(scene.world), DT, 0.0)
    assert velocity[1] == pytest.approx(np.array([-0.5, 0.0]))

"""The polyhedron of allowed velocities: inside the ball, convex, symmetric, and as full as promised."""

from __future__ import annotations

import numpy as np
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.kinematics.inscribed_polyhedron import inscribed_polyhedron

# As `Holonomic` states them.
INNER_RADII = {1: 0.795, 2: 0.934, 3: 0.972, 4: 0.982}
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def reach(sides: FloatArray, direction: FloatArray) -> FloatArray:
    """How far the polyhedron extends in directions, shape (K, 3)."""
    along = direction @ sides[:3]
    limits = np.divide(sides[3], along, out=np.full_like(along, np.inf), where=along < 0.0)
    return np.asarray(limits.min(axis=1))


@pytest.mark.parametrize(("parts", "inner"), INNER_RADII.items())
def test_it_holds_the_inner_sphere_and_lies_in_the_ball(parts: int, inner: float) -> None:
    sides, inner_radius = inscribed_polyhedron(parts)
    assert sides.shape == (4, 20 * parts**2)
    np.testing.assert_allclose(np.linalg.norm(sides[:3], axis=0), 1.0, rtol=1e-14)
    assert inner_radius == pytest.approx(inner, abs=5e-4)
    assert float(-sides[3].max()) == inner_radius
    direction = np.random.default_rng(0).normal(size=(5000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    extent = reach(sides, direction)
    assert (extent >= inner_radius).all()
    assert (extent <= 1.0 + 1e-12).all()
    # The foot of the nearest face is where it is narrowest.
    nearest = int(np.argmax(sides[3]))
    assert reach(sides, -sides[:3, nearest][None])[0] == pytest.approx(inner_radius)


@pytest.mark.parametrize("parts", [1, 2, 4])
def test_it_is_its_own_mirror_image_in_the_planes_of_the_axes(parts: int) -> None:
    sides, _ = inscribed_polyhedron(parts)
    faces = {tuple(face) for face in np.round(sides.T, 9) + 0.0}
    for axis in range(3):
        mirrored = sides.T.copy()
        mirrored[:, axis] *= -1.0
        assert {tuple(face) for face in np.round(mirrored, 9) + 0.0} == faces


@pytest.mark.parametrize("parts", [2, 4, 6])
def test_with_an_even_number_full_speed_along_the_axes_stays_allowed(parts: int) -> None:
    sides, _ = inscribed_polyhedron(parts)
    np.testing.assert_allclose(reach(sides, AXES), 1.0, rtol=1e-12)


def test_a_robot_in_space_is_held_to_it() -> None:
    kinematics = sf.Holonomic([2.0, 3.0], dimension=3, faces=80)
    scene = sf.Scene.from_world([[0, 0, 0], [9, 9, 9]], np.zeros((2, 3)), 0.1)
    wanted = np.array([[5.0, 5.0, 5.0], [0.0, 0.0, 9.0]])
    decision = sf.SafetyFilter([], kinematics).decide(scene, wanted)
    speed = np.linalg.norm(decision.action, axis=1)
    assert decision.optimal.all()
    assert 0.934 * 2.0 <= speed[0] <= 2.0
    np.testing.assert_allclose(decision.action[1], [0.0, 0.0, 3.0], atol=1e-9)


def test_faces_that_no_such_polyhedron_has_are_refused() -> None:
    with pytest.raises(sf.errors.OutOfRange) as caught:
        sf.Holonomic(1.0, dimension=3, faces=100)
    assert str(caught.value) == "faces: expected 20 n^2, such as 80 or 320, got 100"
    with pytest.raises(sf.errors.OutOfRange) as caught:
        sf.Holonomic(1.0, dimension=4)
    assert str(caught.value) == "dimension: expected 2 (plane) or 3 (space), got 4"

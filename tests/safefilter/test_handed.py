"""Kernels find what they are handed under its name, and each number of robots has rules of its own."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter import (
    DifferentialDrive,
    Holonomic,
    PriorityORCA,
    SafetyFilter,
    Scene,
    Separation,
    Uncertainty,
    robot_decisions,
)
from safefilter.arrays import FloatArray
from safefilter.batch.handed import Handed, Limits, make_rules, named, speed_limits
from safefilter.batch.settings import Settings
from safefilter.constraints.priority_orca import NO_ORCA
from safefilter.constraints.separation import NO_SEPARATION
from safefilter.constraints.static_obstacles import NO_STATIC
from safefilter.constraints.user_rows import NUM_MARKS
from safefilter.jit import source_of
from safefilter.kinematics.drive import NO_DRIVE
from safefilter.scene_arrays import PLANE, SPACE


@pytest.mark.parametrize("dimension", [PLANE, SPACE])
def test_kernels_find_what_they_are_handed(dimension: int) -> None:
    kinematics = Holonomic([0.1, 0.2, 0.3], dimension=dimension)
    apart = np.arange(3.0)[:, np.newaxis] * np.ones(dimension)
    scene = Scene.from_world(apart, np.zeros((3, dimension)), 0.1, reach=2.5)
    limits = Limits(kinematics.v_max(scene), kinematics.speed_limit(scene), kinematics.sides)
    settings = Settings(
        NO_ORCA, NO_SEPARATION, NO_STATIC, NO_DRIVE, 1e-9, 1.0, 0.0, kinematics.inner_radius, 2
    )
    index, asked = np.array([2, 0]), np.ones((2, dimension))
    user = np.zeros((2, dimension + 1 + NUM_MARKS, 5))
    rules = make_rules(settings, limits)
    handed = Handed(scene.parts, index, asked, user, rules, is_single=True)
    problem, found = source_of(named)(handed[:])
    assert found == settings
    for part, expected in zip(problem.limits, limits, strict=True):
        np.testing.assert_array_equal(part, expected)
    assert problem.scene == scene.arrays
    for name in ("index", "asked", "user", "is_single"):
        assert getattr(problem, name) is getattr(handed, name)
    assert problem.capacity == kinematics.sides.shape[1] + 3 * scene.most_neighbours + 5
    np.testing.assert_array_equal(handed.speed_limit, limits.speed_limit[index])
    assert handed.wanted is asked
    with_commands = handed._replace(asked=np.arange(8.0).reshape(2, 4))
    np.testing.assert_array_equal(with_commands.wanted, [[0.0, 1.0], [4.0, 5.0]])


def test_speed_limits_are_those_of_the_robots_decided_for() -> None:
    limits = Limits(np.array([1.0, 2.0]), np.array([1.5, 2.5]), np.zeros((3, 4)))
    settings = Settings(NO_ORCA, NO_SEPARATION, NO_STATIC, NO_DRIVE, 1e-9, 1.0, 0.0, 1.0, 1)
    np.testing.assert_array_equal(speed_limits(make_rules(settings, limits), 2), [1.5, 2.5])


EXACT, UNCERTAIN = Uncertainty(), Uncertainty(position_error=0.005, clock_jitter=0.02)


def ring(num_robots: int, *, has_heading: bool) -> tuple[Scene, FloatArray]:
    """Robots 0.3 m apart that want to the middle."""
    angle = 2.0 * np.pi * np.arange(num_robots) / num_robots
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    position = 0.15 / np.sin(np.pi / max(2, num_robots)) * outward
    scene = Scene.from_world(
        position, -0.1 * outward, 0.1, heading=angle + 3.0 if has_heading else None
    )
    return scene, np.tile([0.2, 0.5], (num_robots, 1)) if has_heading else -0.2 * outward


def assert_alike(one: SafetyFilter, other: SafetyFilter, num_robots: int) -> None:
    scene, action = ring(num_robots, has_heading=isinstance(one.kinematics, DifferentialDrive))
    found, expected = one.decide(scene, action), other.decide(scene, action)
    assert expected.certified.all()
    for name in ("action", "velocity", "case", "active", "violation"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def made(*, is_drive: bool, uncertainty: Uncertainty = EXACT) -> SafetyFilter:
    kinematics = (
        DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.02) if is_drive else Holonomic(0.2)
    )
    separation = Separation(0.2, uncertainty=uncertainty)
    return SafetyFilter([PriorityORCA(2.0), separation], kinematics)


@pytest.mark.parametrize("is_drive", [False, True])
@pytest.mark.parametrize("uncertainty", [EXACT, UNCERTAIN])
def test_a_filter_decides_as_a_new_one_whatever_it_has_decided_before(
    *, is_drive: bool, uncertainty: Uncertainty, monkeypatch: pytest.MonkeyPatch
) -> None:
    used = made(is_drive=is_drive, uncertainty=uncertainty)
    # Room for some of them at a time.
    monkeypatch.setattr(robot_decisions, "MOST_KEPT", 2000)
    for num_robots in [3, 150, 3, *range(1, 105), 300, 3, 150]:
        ring_of, action = ring(num_robots, has_heading=is_drive)
        used.decide(ring_of, action)
        # Each is compared twice: with what was kept, and with what took its place.
        if num_robots in {3, 7, 100, 150, 300}:
            assert_alike(used, made(is_drive=is_drive, uncertainty=uncertainty), num_robots)
        kept = [len(rules) for rules in used._decisions._rules.values()]  # type: ignore[union-attr]
        assert sum(kept[:-1]) <= 2000


@pytest.mark.parametrize("is_drive", [False, True])
def test_a_filter_with_more_constraints_has_rules_of_its_own(*, is_drive: bool) -> None:
    kinematics = made(is_drive=is_drive).kinematics
    bare = SafetyFilter([PriorityORCA(2.0)], kinematics)
    scene, action = ring(5, has_heading=is_drive)
    bare.decide(scene, action)
    separation = Separation(0.2, uncertainty=UNCERTAIN)
    whole = SafetyFilter([PriorityORCA(2.0), separation], kinematics)
    assert_alike(bare.with_constraints(separation), whole, 5)

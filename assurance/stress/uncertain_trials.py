"""Robots that know too little, with errors on their stated bounds or within: trials for `roll_out_uncertain`.

Letters: N robots. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter import (
    Constraint,
    DifferentialDrive,
    Holonomic,
    PriorityORCA,
    SafetyFilter,
    Scene,
    Separation,
    Uncertainty,
)
from safefilter.arrays import FloatArray
from safefilter.testing.crowds import PRIORITY_DECADES, put_down
from safefilter.testing.policies import Policy, Ramming, UniformRandom
from safefilter.testing.uncertain_loop import (
    SIDES,
    Adversary,
    AtRandom,
    Errors,
    UncertainTrial,
)

DT = 0.2
RADII, SPEEDS = (0.05, 0.5), (0.1, 1.0)  # m, m/s
MIN_ROBOTS, MAX_ROBOTS = 2, 8
PASSIVE_PART, WALLED_PART = 0.3, 0.5
TURN_RATES = (0.0, 0.0, 0.5, 1.5)  # rad/s; 0: holonomic
# The largest of each error that is stated; each is off, on, or somewhere between.
LARGEST = {
    "position_error": 0.06,
    "heading_error": 0.2,
    "velocity_error": 0.3,
    "observation_delay": 0.3,
    "actuation_delay": 0.3,
    "clock_jitter": 0.2,
    "actuation_error": 0.4,
}
MOST_LOST = 2
ERRORS: tuple[Errors, ...] = (
    Adversary(),
    Adversary(SIDES[:1]),
    Adversary(SIDES[2:]),
    AtRandom(),
)
POLICIES: tuple[Policy, ...] = (Ramming(), UniformRandom())
# Everybody a little further from everybody: apart by more than the safety margin at the start.
SPREAD = 1.001
NUM_STEPS = 12
# What a drive that does not execute its heading exactly may be off by at most, in rad: budgets hold up to there.
MOST_TURNED = 0.5 * math.pi
ACTUATION_SLACK = 1.05


class UncertainCase(NamedTuple):
    """A trial and the filter of its robots."""

    trial: UncertainTrial
    safety_filter: SafetyFilter


def uncertain_trial(rng: np.random.Generator, seed: int) -> UncertainCase:
    """Draw one.

    Args:
        rng: Source of chance: of robots, walls, bounds and filter.
        seed: Seed of errors and policy.
    """
    omega_max, bounds = float(rng.choice(TURN_RATES)), _bounds(rng)
    while omega_max > 0.0 and not _is_stated_well(bounds, omega_max):
        bounds = _bounds(rng)
    v_max = float(rng.uniform(*SPEEDS))
    trial = UncertainTrial(
        _scene(rng, v_max),
        POLICIES[rng.integers(len(POLICIES))],
        v_max,
        bounds,
        ERRORS[rng.integers(len(ERRORS))],
        DT,
        NUM_STEPS,
        seed,
        omega_max,
    )
    kinematics = DifferentialDrive(v_max, omega_max, DT, 0.01) if omega_max else Holonomic(v_max)
    separation = Separation(DT, uncertainty=bounds)
    # Soft rows slow robots down before they meet: half of the trials do without.
    constraints: list[Constraint] = [separation]
    if rng.integers(2):
        constraints.append(PriorityORCA(2.0))
    return UncertainCase(trial, SafetyFilter(constraints, kinematics))


def _bounds(rng: np.random.Generator) -> Uncertainty:
    part = rng.choice([0.0, 1.0, 1.0, math.nan], len(LARGEST))
    part = np.where(np.isnan(part), rng.uniform(size=len(part)), part)
    errors = {name: float(part[k] * largest) for k, (name, largest) in enumerate(LARGEST.items())}
    return Uncertainty(lost_messages=int(rng.integers(MOST_LOST + 1)), **errors)


def _is_stated_well(bounds: Uncertainty, omega_max: float) -> bool:
    """Can a drive know where it heads to less than a right angle? Otherwise `Separation` refuses the bounds."""
    rate = omega_max + 2.0 * bounds.actuation_error / (DT + bounds.lateness)
    turned = bounds.heading_error + rate * bounds.stale_time(DT)
    off = math.asin(min(1.0, ACTUATION_SLACK * bounds.actuation_error))
    return turned + off < MOST_TURNED


def _scene(rng: np.random.Generator, v_max: float) -> Scene:
    size = int(rng.integers(MIN_ROBOTS, MAX_ROBOTS + 1))
    radius = rng.uniform(*RADII, size)
    position = SPREAD * put_down(rng, np.array([size]), radius)
    cooperative = np.full(size, fill_value=True)
    cooperative[-1] = size == MIN_ROBOTS or rng.uniform() >= PASSIVE_PART
    angle, speed = rng.uniform(0.0, 2.0 * math.pi), v_max * rng.uniform()
    course = speed * np.array([math.cos(angle), math.sin(angle)])
    return Scene.from_world(
        position,
        np.where(cooperative[:, None], 0.0, course),
        radius,
        heading=rng.uniform(-math.pi, math.pi, size),
        priority=10.0 ** rng.uniform(-PRIORITY_DECADES, PRIORITY_DECADES, size),
        cooperative=cooperative,
        walls=_wall(rng, position, radius) if rng.uniform() < WALLED_PART else None,
    )


def _wall(rng: np.random.Generator, position: FloatArray, radius: FloatArray) -> FloatArray:
    """A wall just below everybody, shape (1, 2, 2), in m."""
    lowest = float((position[:, 1] - radius).min()) - float(rng.choice([0.001, 0.1]))
    left, right = np.sort(rng.uniform(position[:, 0].min(), position[:, 0].max() + 0.1, 2))
    return np.array([[[left, lowest], [right, lowest]]])

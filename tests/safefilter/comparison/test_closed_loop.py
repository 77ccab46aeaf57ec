"""The crossing: what comes of trusting a solver, and of verifying it."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.comparison.closed_loop import DT, NUM_ROBOTS, RADIUS, crossing, drive_across
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.runner import LOOP_STEPS
from safefilter.programs.convex_program import ConvexProgram

STEPS = 30


class Reckless:
    """Calls the wish itself optimal."""

    name = "reckless"
    capabilities = Capabilities(qp=True, lp=True)

    def __init__(self, tolerance: float) -> None:
        pass

    def solve(self, program: ConvexProgram) -> Solution:
        x = -program.q if not program.is_linear else np.zeros(program.num_variables)
        return Solution(Status.OPTIMAL, x, np.zeros(program.num_rows), 0.0, 0.0)


class Silent(Reckless):
    """Never says anything."""

    name = "silent"

    def solve(self, program: ConvexProgram) -> Solution:
        return Solution.without_point(program, Status.FAILED, 0.0, 0.0)


def reckless(tolerance: float) -> Backend:
    return Reckless(tolerance)


def silent(tolerance: float) -> Backend:
    return Silent(tolerance)


REGISTERED = {"reckless": reckless, "silent": silent}


def test_robots_start_apart() -> None:
    start = crossing().start
    distance = np.linalg.norm(start[:, None] - start[None], axis=2)
    assert distance[~np.eye(NUM_ROBOTS, dtype=np.bool_)].min() > 2.0 * RADIUS


def test_trusting_a_reckless_solver_ends_in_collisions() -> None:
    found = drive_across(
        Contender("reckless", Setting.TOLERANCE), is_verified=False, num_steps=STEPS
    )
    assert found.collisions > 0
    assert found.min_clearance < -0.05
    assert found.not_own == 0 < found.decisions


def test_through_the_filter_it_does_not() -> None:
    contender = Contender("reckless", Setting.TOLERANCE)
    found = drive_across(contender, is_verified=True, num_steps=STEPS)
    assert found.collisions == 0
    assert found.min_clearance > 0.0
    assert 0 < found.not_own <= found.decisions


def test_a_silent_solver_leaves_robots_standing() -> None:
    found = drive_across(Contender("silent", Setting.TOLERANCE), is_verified=False, num_steps=STEPS)
    assert found.not_own == found.decisions > 0
    assert found.collisions == 0


@pytest.mark.parametrize("is_verified", [False, True])
def test_an_exact_solver_is_the_same_trusted_or_verified(is_verified: bool) -> None:
    contender = Contender("planar", Setting.TOLERANCE)
    found = drive_across(contender, is_verified=is_verified, num_steps=STEPS)
    assert found.collisions == found.not_own == 0
    assert found.min_clearance > 0.0
    assert found.is_verified is is_verified
    assert found.step_time > 0.0


def test_everybody_arrives() -> None:
    contender = Contender("planar", Setting.TOLERANCE)
    found = drive_across(contender, is_verified=True, num_steps=LOOP_STEPS)
    assert found.arrived == 1.0
    assert 0.0 < found.time_to_goal < LOOP_STEPS * DT

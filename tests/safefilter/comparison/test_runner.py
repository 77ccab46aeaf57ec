"""A run goes through, whatever solvers do: hang, die, raise, or refuse."""

from __future__ import annotations

import os
from dataclasses import replace
from time import sleep

import numpy as np
import pytest

from safefilter.backends.backend import Backend, Capabilities, Solution
from safefilter.backends.planar import Planar
from safefilter.backends.registry import register_backend
from safefilter.comparison.attempt import Fate
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem, ProblemSet
from safefilter.comparison.runner import MOST_STRIKES, Comparison, Plan, compare_backends
from safefilter.comparison.worker import Mode
from safefilter.errors import InvalidInput
from safefilter.programs.convex_program import ConvexProgram

# Longer than any answer takes.
PATIENCE = 60.0


class Moody:
    """As good as the built-in solver, but for problems whose wish tells it to hang or to die."""

    name = "moody"
    capabilities = Capabilities(qp=True, lp=True, max_variables=3)

    def __init__(self, tolerance: float) -> None:
        self._planar = Planar(tolerance)

    def solve(self, program: ConvexProgram) -> Solution:
        if not program.is_linear and program.q[1] == -0.25:
            sleep(PATIENCE)
        if not program.is_linear and program.q[1] == -0.125:
            os._exit(1)
        return self._planar.solve(program)


class Dead(Moody):
    """Dies at every program."""

    name = "dead"

    def solve(self, program: ConvexProgram) -> Solution:  # noqa: ARG002 - it looks at none
        os._exit(1)


def moody(tolerance: float) -> Backend:
    return Moody(tolerance)


def dead(tolerance: float) -> Backend:
    return Dead(tolerance)


PLANAR = Contender("planar", Setting.TOLERANCE)
MOODY = Contender("moody", Setting.TOLERANCE)
DEAD = Contender("dead", Setting.TOLERANCE)


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    wall = (np.concatenate([np.eye(2), -np.eye(2), [[1.0, 0.0]]]), [-1.0] * 4 + [0.5])
    hard = np.arange(5) < 4

    def problem(wanted: float) -> Problem:
        return Problem.of("a", [0.0, wanted], *wall, hard, scale=1.0, radius=2.0)

    plain, hangs, dies = problem(0.0), problem(0.25), problem(0.125)
    problems = (plain, plain, hangs, dies, plain)
    # The answers to the last ones are left to be found.
    truths = {k: truth_of(problems[k], 5e-9) for k in range(3)}
    plane = ProblemSet("plane", "", "m/s", problems, truths)
    told: list[tuple[int, int, str]] = []
    found = compare_backends(
        [plane],
        [MOODY, DEAD, PLANAR],
        Plan(rounds=1, time_limit=3.0, loop_steps=2),
        lambda *told_now: told.append(told_now),
    )
    assert told[-1][2].startswith("crossing: ")
    return found


def fates(comparison: Comparison, contender: Contender, mode: Mode) -> list[Fate]:
    return [attempt.fate for attempt in comparison.attempts[contender, mode, "plane"]]


def test_a_solver_that_hangs_or_dies_fails_there_and_nowhere_else(comparison: Comparison) -> None:
    well = Fate.ANSWERED
    # Cold and in sequence take turns. Its third strike, dead at a cold start, is the last time that it is asked.
    assert MOST_STRIKES == 3
    cold, sequence = (fates(comparison, MOODY, mode) for mode in (Mode.COLD, Mode.SEQUENCE))
    assert cold == [well, well, Fate.LATE, Fate.KILLED, Fate.STRUCK]
    assert sequence == [well, well, Fate.LATE, Fate.STRUCK, Fate.STRUCK]


def test_the_others_go_on(comparison: Comparison) -> None:
    for mode in Mode:
        assert fates(comparison, PLANAR, mode) == [Fate.ANSWERED] * 5
        attempts = comparison.attempts[PLANAR, mode, "plane"]
        assert all(attempt.is_own and attempt.off < 1e-8 for attempt in attempts)


def test_a_solver_that_always_dies_is_struck_out(comparison: Comparison) -> None:
    for mode in Mode:
        assert set(fates(comparison, DEAD, mode)) <= {Fate.KILLED, Fate.STRUCK}
    assert DEAD not in comparison.crossings


def test_answers_that_were_missing_were_found(comparison: Comparison) -> None:
    (plane,) = comparison.sets
    assert sorted(plane.truths) == [0, 1, 2, 3, 4]
    assert plane.truths[3].point.tolist() == [0.5, 0.125]


def test_crossings_are_made_trusted_and_verified(comparison: Comparison) -> None:
    assert [crossing.is_verified for crossing in comparison.crossings[PLANAR]] == [False, True]


def test_a_run_that_is_cut_short_says_so(comparison: Comparison) -> None:
    (plane,) = comparison.sets
    found = compare_backends([plane.part([0, 1])], [PLANAR], Plan(rounds=2, seconds=1e-9))
    # Two cold decisions, four in sequence, two crossings.
    assert (found.left_out, found.attempts, found.crossings) == (8, {}, {})


def test_machine_and_versions_are_noted(comparison: Comparison) -> None:
    assert {"numpy", "osqp", "processor", "load at start"} <= set(comparison.machine)
    assert comparison.seconds > 0.0
    assert comparison.left_out == 0


def test_a_run_of_nothing_is_refused(comparison: Comparison) -> None:
    (plane,) = comparison.sets
    for sets, contenders in (([], [PLANAR]), ([plane], []), ([plane, replace(plane)], [PLANAR])):
        with pytest.raises(InvalidInput, match="expected problem sets of different names"):
            compare_backends(sets, contenders)


def test_a_backend_that_cannot_be_sent_is_refused(comparison: Comparison) -> None:
    def local(tolerance: float) -> Backend:
        return Moody(tolerance)

    register_backend("local", local)
    with pytest.raises(InvalidInput, match="use functions or classes at the top level"):
        compare_backends(comparison.sets, [Contender("local", Setting.TIGHT)])


def test_a_process_that_does_not_come_up_is_an_error(
    comparison: Comparison, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InvalidInput, match="does not come up"):
        compare_backends(comparison.sets, [Contender("stillborn", Setting.TIGHT)])
    assert "not on this machine" in capfd.readouterr().err


class Stillborn:
    """A factory that cannot be loaded elsewhere."""

    def __reduce__(self) -> tuple[object, ...]:
        return fail, ()

    def __call__(self, tolerance: float) -> Backend:
        return Moody(tolerance)


def fail() -> None:
    raise RuntimeError("not on this machine")


REGISTERED = {"moody": moody, "dead": dead, "stillborn": Stillborn()}

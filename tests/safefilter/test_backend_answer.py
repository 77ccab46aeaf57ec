"""One decision by a backend that cannot be trusted: each fault has its name, and none gets through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backend_answer import (
    LINEAR_BACKEND,
    BackendAnswer,
    Solvers,
    ask_backend,
    make_solvers,
)
from safefilter.backends import registry
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.planar import Planar
from safefilter.backends.supervised import Supervised
from safefilter.decision import Case, Fault
from safefilter.errors import BackendFailed, InvalidInput, UnknownBackend
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS

TOLERANCE = 1e-9
BOX = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
# Soft rows: x >= 0.3; and x >= 0.3 with x <= 0.1, which miss each other by 0.2.
ONE_SIDED = ([[1.0, 0.0]], [0.3])
HEAD_ON = ([[1.0, 0.0], [-1.0, 0.0]], [0.3, -0.1])


def half_spaces(soft: npt.ArrayLike, offsets: npt.ArrayLike) -> HalfSpaces:
    """Soft rows in a hard box of 0.5 m/s, one decision."""
    normals = np.concatenate([BOX, np.reshape(soft, (-1, 2))])
    num_rows = len(normals)
    return HalfSpaces(
        normals=normals[None],
        offsets=np.append(np.full(4, -0.5), offsets)[None],
        hard=(np.arange(num_rows) < 4)[None],
        present=np.ones((1, num_rows), dtype=np.bool_),
        labels=np.zeros((1, num_rows, 2), dtype=np.int64),
        sources=("rows",),
    )


class Scripted:
    """The exact solver, with its answers to projections and linear programs spoilt each in its own way."""

    name = "scripted"
    capabilities = Capabilities(qp=True, lp=True, max_variables=3)

    def __init__(
        self,
        projection: Callable[[Solution], Solution] = lambda solution: solution,
        linear: Callable[[Solution], Solution] = lambda solution: solution,
    ) -> None:
        self._exact = Planar(TOLERANCE)
        self._projection, self._linear = projection, linear
        self.num_asked = 0

    def solve(self, program: ConvexProgram) -> Solution:
        self.num_asked += 1
        spoil = self._linear if program.is_linear else self._projection
        return replace(spoil(self._exact.solve(program)), build_time=0.25, solve_time=0.5)


def to(status: Status) -> Callable[[Solution], Solution]:
    """Replace the status, and the point where there is none."""

    def spoil(solution: Solution) -> Solution:
        if status.has_point:
            return replace(solution, status=status)
        x, multipliers = (
            np.full_like(solution.x, np.nan),
            np.full_like(solution.multipliers, np.nan),
        )
        return replace(solution, status=status, x=x, multipliers=multipliers)

    return spoil


def elsewhere(solution: Solution) -> Solution:
    point = np.full_like(solution.x, 0.05)
    return replace(
        solution, status=Status.OPTIMAL, x=point, multipliers=np.zeros_like(solution.multipliers)
    )


def ask(
    backend: Backend, rows: HalfSpaces, wanted: npt.ArrayLike = (0.0, 0.2), radius: float = 1.0
) -> BackendAnswer:
    solvers = Solvers(backend, backend, TOLERANCE)
    return ask_backend(solvers, rows, 0, np.asarray(wanted, dtype=np.float64), radius)


def test_an_honest_backend_finds_case_2_with_its_multipliers() -> None:
    answer = ask(Scripted(), half_spaces(*ONE_SIDED))
    assert (answer.fault, answer.case) == (Fault.NONE, Case.PROJECTED)
    assert answer.velocity == pytest.approx([0.3, 0.2], abs=1e-15)
    assert answer.multipliers == pytest.approx([0, 0, 0, 0, 0.3], abs=1e-15)
    assert answer.proof.tolist() == [0.0] * 5
    assert (answer.build_time, answer.solve_time) == (0.25, 0.5)


def test_an_honest_backend_finds_case_3_with_its_proof() -> None:
    backend = Scripted()
    answer = ask(backend, half_spaces(*HEAD_ON))
    assert (answer.fault, answer.case) == (Fault.NONE, Case.LEAST_VIOLATION)
    assert answer.velocity == pytest.approx([0.2, 0.2], abs=2.0 * TOLERANCE)
    assert answer.proof == pytest.approx([0, 0, 0, 0, 0.5, 0.5], abs=1e-12)
    assert backend.num_asked == 3
    assert (answer.build_time, answer.solve_time) == (0.75, 1.5)


@pytest.mark.parametrize(
    "status", [Status.INACCURATE, Status.TIME_LIMIT, Status.FAILED, Status.INFEASIBLE]
)
def test_the_case_is_decided_by_the_least_violation_not_by_a_status(status: Status) -> None:
    # What first-order solvers say of empty sets, and sometimes of sets that are not.
    first = iter([to(status)])

    def spoil_once(solution: Solution) -> Solution:
        return next(first, lambda same: same)(solution)

    answer = ask(Scripted(spoil_once), half_spaces(*HEAD_ON))
    assert (answer.fault, answer.case) == (Fault.NONE, Case.LEAST_VIOLATION)


def test_a_projection_that_ran_out_of_time_is_asked_again_with_the_tolerance_to_spare() -> None:
    first = iter([to(Status.TIME_LIMIT)])

    def spoil_once(solution: Solution) -> Solution:
        return next(first, lambda same: same)(solution)

    answer = ask(Scripted(spoil_once), half_spaces(*ONE_SIDED))
    assert (answer.fault, answer.case) == (Fault.NONE, Case.PROJECTED)
    assert answer.velocity == pytest.approx([0.3, 0.2], abs=2.0 * TOLERANCE)
    assert answer.proof.tolist() == [0.0] * 5


@pytest.mark.parametrize(
    ("projection", "linear", "soft", "fault"),
    [
        # Statuses that a proof refutes.
        (to(Status.INFEASIBLE), None, ONE_SIDED, Fault.BACKEND_WRONG_STATUS),
        (to(Status.UNBOUNDED), None, ONE_SIDED, Fault.BACKEND_WRONG_STATUS),
        (elsewhere, None, HEAD_ON, Fault.BACKEND_WRONG_STATUS),
        (None, to(Status.INFEASIBLE), HEAD_ON, Fault.BACKEND_WRONG_STATUS),
        (None, to(Status.UNBOUNDED), HEAD_ON, Fault.BACKEND_WRONG_STATUS),
        # Points that fail verification.
        (to(Status.NOT_FINITE), None, ONE_SIDED, Fault.BACKEND_REJECTED),
        (elsewhere, None, ONE_SIDED, Fault.BACKEND_REJECTED),
        (to(Status.TIME_LIMIT), None, ONE_SIDED, Fault.BACKEND_REJECTED),
        (to(Status.FAILED), None, HEAD_ON, Fault.BACKEND_REJECTED),
        (None, elsewhere, HEAD_ON, Fault.BACKEND_REJECTED),
        (None, to(Status.FAILED), HEAD_ON, Fault.BACKEND_REJECTED),
    ],
)
def test_every_lie_has_its_name(
    projection: Callable[[Solution], Solution] | None,
    linear: Callable[[Solution], Solution] | None,
    soft: tuple[list[list[float]], list[float]],
    fault: Fault,
) -> None:
    def same(solution: Solution) -> Solution:
        return solution

    answer = ask(Scripted(projection or same, linear or same), half_spaces(*soft))
    assert answer.fault is fault
    assert np.isnan(answer.velocity).all()
    assert answer.multipliers.tolist() == answer.proof.tolist() == [0.0] * (4 + len(soft[1]))


@pytest.mark.parametrize(
    "error",
    [
        ValueError("no"),
        KeyError("no"),
        ZeroDivisionError("no"),
        MemoryError(),
        BackendFailed(
            "no", ConvexProgram(np.eye(1), np.zeros(1), np.eye(1), np.ones(1)), Status.FAILED
        ),
    ],
)
def test_whatever_a_backend_raises_is_a_fault(error: Exception) -> None:
    def fail(_: Solution) -> Solution:
        raise error

    assert ask(Scripted(fail), half_spaces(*ONE_SIDED)).fault is Fault.BACKEND_RAISED


@pytest.mark.parametrize("interrupt", [KeyboardInterrupt, SystemExit])
def test_a_person_who_interrupts_is_obeyed(interrupt: type[BaseException]) -> None:
    def stop(_: Solution) -> Solution:
        raise interrupt

    with pytest.raises(interrupt):
        ask(Scripted(stop), half_spaces(*ONE_SIDED))


@pytest.mark.parametrize("name", FAULTS)
@given(
    angles=st.lists(st.floats(0.0, 6.28), min_size=1, max_size=4),
    offset=st.floats(-0.2, 0.4),
    wanted=st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)),
)
def test_whatever_is_wrong_with_a_backend_an_answer_without_fault_is_the_right_one(
    name: str, angles: list[float], offset: float, wanted: tuple[float, float]
) -> None:
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    rows = half_spaces(normals, np.full(len(angles), offset))
    backend = FAULTS[name](TOLERANCE)
    honest = ask(Planar(TOLERANCE), rows, wanted)
    assume(
        honest.fault is Fault.NONE
    )  # t* between 0 and the tolerance: empty to some, not to others
    for target in (wanted, (0.1, -0.2), wanted):
        answer = ask(backend, rows, target)
        if answer.fault is Fault.NONE and target == wanted:
            assert answer.case is honest.case
            assert answer.velocity == pytest.approx(honest.velocity, abs=1e-7)


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("Raises", Fault.BACKEND_RAISED),
        ("AnswersNothing", Fault.BACKEND_RAISED),
        ("ReturnsNaN", Fault.BACKEND_REJECTED),
        ("FeasibleCalledInfeasible", Fault.BACKEND_WRONG_STATUS),
        ("AllCalledInfeasible", Fault.BACKEND_WRONG_STATUS),
        ("SwapsSign", Fault.BACKEND_WRONG_STATUS),
        ("IgnoresRows", Fault.BACKEND_REJECTED),
        ("Mirrors", Fault.BACKEND_REJECTED),
    ],
)
def test_known_faults_are_noticed(name: str, fault: Fault) -> None:
    backend = FAULTS[f"fault:{name}"](TOLERANCE)
    assert ask(backend, half_spaces(*ONE_SIDED)).fault is fault


def test_a_point_slightly_off_is_polished_into_the_right_one() -> None:
    answer = ask(FAULTS["fault:Perturbs"](TOLERANCE), half_spaces(*ONE_SIDED))
    assert answer.fault is Fault.NONE
    assert answer.velocity == pytest.approx([0.3, 0.2], abs=1e-12)


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """All faults are registered while a test runs."""
    monkeypatch.setattr(registry, "_registered", dict(FAULTS | FAULTS_IN_A_PROCESS))


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("name", "deadline", "fault"),
    [("fault:Hangs", 0.5, Fault.DEADLINE), ("fault:Dies", 60.0, Fault.BACKEND_RAISED)],
)
def test_with_a_deadline_a_backend_may_hang_or_die(
    name: str, deadline: float, fault: Fault
) -> None:
    solvers = make_solvers(name, TOLERANCE, deadline)
    assert isinstance(solvers.quadratic, Supervised)
    assert solvers.linear is solvers.quadratic
    rows = half_spaces(*ONE_SIDED)
    wanted: FloatArray = np.zeros(2)
    solvers.start()
    assert not solvers.is_late
    assert ask_backend(solvers, rows, 0, wanted, 1.0).fault is fault
    assert solvers.is_late == (fault is Fault.DEADLINE)


@pytest.mark.usefixtures("registered")
def test_what_fails_after_the_deadline_is_called_late() -> None:
    solvers = make_solvers("fault:Raises", TOLERANCE, 1e-9)
    solvers.start()
    answer = ask_backend(solvers, half_spaces(*ONE_SIDED), 0, np.zeros(2), 1.0)
    assert answer.fault is Fault.DEADLINE


def test_a_backend_without_linear_programs_gets_help() -> None:
    solvers = make_solvers("qpsolvers:quadprog", TOLERANCE, None)
    assert solvers.quadratic.name == "qpsolvers:quadprog"
    assert solvers.linear.name == LINEAR_BACKEND
    answer = ask_backend(solvers, half_spaces(*HEAD_ON), 0, np.array([0.0, 0.2]), 1.0)
    assert (answer.fault, answer.case) == (Fault.NONE, Case.LEAST_VIOLATION)
    assert not solvers.is_late


def test_with_a_deadline_the_help_works_in_a_process_of_its_own_too() -> None:
    solvers = make_solvers("qpsolvers:quadprog", TOLERANCE, 60.0)
    assert isinstance(solvers.linear, Supervised)
    assert solvers.linear is not solvers.quadratic
    solvers.start()
    answer = ask_backend(solvers, half_spaces(*HEAD_ON), 0, np.array([0.0, 0.2]), 1.0)
    assert (answer.fault, answer.case) == (Fault.NONE, Case.LEAST_VIOLATION)


def test_names_are_checked_before_anything_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UnknownBackend, match="no backend is called 'nobody'"):
        make_solvers("nobody", TOLERANCE, 1.0)

    def local(tolerance: float) -> Backend:
        return Planar(tolerance)

    monkeypatch.setattr(registry, "_registered", {"local": local})
    with pytest.raises(InvalidInput, match="use a function or class at the top level of a module"):
        make_solvers("local", TOLERANCE, 1.0)

"""Backends in a process of their own: late, dead, raising, and gone when nobody needs them any more."""

from __future__ import annotations

import gc
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.planar import Planar
from safefilter.backends.supervised import Supervised, serve
from safefilter.errors import BackendFailed, InvalidInput, OutOfRange
from safefilter.programs.convex_program import ConvexProgram

ROOT = Path(__file__).parents[2]
# Longer than any answer takes, and than most starts of the interpreter; never waited for in full.
PATIENCE = 60.0
MOST_TRIES = 2000


def program(wanted: float) -> ConvexProgram:
    """A projection whose wanted point tells `Moody` how to behave."""
    return ConvexProgram(
        np.eye(2), np.array([-wanted, 0.0]), np.array([[1.0, 0.0]]), np.array([0.5])
    )


HONEST, HANG, DIE, RAISE, LEAVE = (program(wanted) for wanted in (1.0, 2.0, 3.0, 4.0, 5.0))


class Moody:
    """Answers with the number of its process, or as asked: hangs, dies, raises, leaves."""

    name = "moody"
    capabilities = Capabilities(qp=True, lp=False, max_variables=2)

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance

    def solve(self, asked: ConvexProgram) -> Solution:
        wanted = -asked.q[0]
        if wanted == 2.0:
            sleep(PATIENCE)
        elif wanted == 3.0:
            os._exit(1)
        elif wanted == 4.0:
            raise ValueError("not in the mood")
        elif wanted == 5.0:
            raise SystemExit(0)
        x = np.array([os.getpid(), self._tolerance])
        return Solution(Status.OPTIMAL, x, np.zeros(1), 0.0, 0.0)


class Unmakeable(Moody):
    """Cannot be made."""

    def __init__(self, tolerance: float) -> None:
        super().__init__(tolerance)
        raise RuntimeError("no licence")


def supervised(
    factory: Callable[[float], Backend] = Moody, deadline: float = PATIENCE
) -> Supervised:
    return Supervised(Moody(1e-9), factory, 1e-9, deadline)


def process_of(backend: Supervised) -> int:
    """Number of the process that answers, once it does."""
    for _ in range(MOST_TRIES):
        backend.start()
        solution = backend.solve(HONEST)
        if solution.status is Status.OPTIMAL:
            return int(solution.x[0])
    raise AssertionError("the worker does not come back")


def is_gone(process: int) -> bool:
    """Has it ended, and been waited for? A zombie still takes signals."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False


def test_answers_are_those_of_the_backend_bit_for_bit() -> None:
    asked = ConvexProgram(
        np.eye(2), np.array([-0.7, 0.3]), np.array([[0.6, 0.8], [1.0, 0.0]]), np.array([0.1, 0.2])
    )
    backend = Supervised(Planar(1e-9), Planar, 1e-9, PATIENCE)
    backend.start()
    here, there = Planar(1e-9).solve(asked), backend.solve(asked)
    assert there.status is here.status
    np.testing.assert_array_equal(there.x, here.x)
    np.testing.assert_array_equal(there.multipliers, here.multipliers)
    assert not backend.is_late


def test_it_goes_by_the_name_and_capabilities_of_the_backend() -> None:
    backend = supervised()
    assert backend.name == "moody"
    assert backend.capabilities == Moody.capabilities


def test_it_works_in_one_other_process_with_the_tolerance_given() -> None:
    backend = supervised()
    backend.start()
    first, second = backend.solve(HONEST), backend.solve(HONEST)
    assert first.x[0] == second.x[0] != os.getpid()
    assert first.x[1] == 1e-9


def test_a_hanging_backend_is_late_and_works_again_in_a_new_process() -> None:
    backend = supervised(deadline=0.5)
    hung = process_of(backend)
    backend.start()
    solution = backend.solve(HANG)
    assert solution.status is Status.TIME_LIMIT
    assert np.isnan(solution.x).all()
    assert solution.solve_time >= 0.25
    assert backend.is_late
    assert is_gone(hung)
    assert process_of(backend) != hung


def test_once_the_time_is_up_nothing_is_asked_any_more() -> None:
    backend = supervised(deadline=1e-9)
    backend.start()
    assert backend.is_late
    for asked in (HONEST, HANG, DIE, RAISE):
        assert backend.solve(asked).status is Status.TIME_LIMIT


def test_a_process_that_died_is_reported_and_replaced() -> None:
    backend = supervised()
    dead = process_of(backend)
    with pytest.raises(BackendFailed) as caught:
        backend.solve(DIE)
    assert str(caught.value) == "moody: its process died"
    assert caught.value.program is DIE
    assert caught.value.status is Status.FAILED
    assert is_gone(dead)
    assert process_of(backend) != dead


def test_a_backend_that_leaves_is_a_process_that_died() -> None:
    backend = supervised()
    backend.start()
    with pytest.raises(BackendFailed, match="moody: its process died"):
        backend.solve(LEAVE)


def test_what_the_backend_raises_comes_through_and_the_process_stays() -> None:
    backend = supervised()
    process = process_of(backend)
    with pytest.raises(BackendFailed) as caught:
        backend.solve(RAISE)
    assert str(caught.value) == "moody: ValueError: not in the mood"
    assert caught.value.program is RAISE
    assert process_of(backend) == process


def test_nobody_is_left_behind_when_the_backend_is_dropped() -> None:
    backend = supervised()
    process = process_of(backend)
    del backend
    gc.collect()
    assert is_gone(process)


def test_a_factory_that_cannot_be_sent_is_refused() -> None:
    def local(tolerance: float) -> Backend:
        return Moody(tolerance)

    with pytest.raises(InvalidInput) as caught:
        supervised(local)
    assert str(caught.value).startswith(
        "deadline: backend 'moody' has to run in a process of its own, but its factory cannot be sent there ("
    )
    assert str(caught.value).endswith("); use a function or class at the top level of a module")


def test_a_factory_that_fails_there_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InvalidInput) as caught:
        supervised(Unmakeable)
    assert str(caught.value) == (
        "deadline: the process for backend 'moody' does not come up; can "
        f"{Unmakeable!r} be imported outside of this process?"
    )
    assert "no licence" in capfd.readouterr().err


@pytest.mark.parametrize("deadline", [0.0, -1.0])
def test_a_deadline_in_the_past_is_refused(deadline: float) -> None:
    with pytest.raises(OutOfRange) as caught:
        supervised(deadline=deadline)
    assert str(caught.value) == f"deadline: expected a number above 0, got {deadline}"


def test_the_worker_answers_until_the_pipe_closes() -> None:
    # The child's loop, run here: orders are written before it starts.
    to_read, child_write = os.pipe()
    child_read, to_write = os.pipe()
    orders, replies = Connection(to_write, readable=False), Connection(to_read, writable=False)
    orders.send_bytes(pickle.dumps((Moody, 1e-9)))
    for asked in (HONEST, RAISE, HONEST):
        orders.send((asked.P, asked.q, asked.G, asked.h))
    orders.close()
    serve(child_read, child_write)
    assert replies.recv() == "ready"
    assert replies.recv().x[0] == os.getpid()
    assert replies.recv() == "ValueError: not in the mood"
    assert replies.recv().status is Status.OPTIMAL
    with pytest.raises(EOFError):
        replies.recv()


SCRIPT = """
from safefilter.backends.planar import Planar
from safefilter.backends.supervised import Supervised
from safefilter.programs.convex_program import ConvexProgram
print("imported")
backend = Supervised(Planar(1e-9), Planar, 1e-9, 60.0)
backend.start()
print(backend.solve(ConvexProgram([[1, 0], [0, 1]], [-3, 4], [[1, 0]], [2])).x)
"""


def test_a_script_without_a_main_guard_runs_once_and_ends_with_its_worker(tmp_path: Path) -> None:
    script = tmp_path / "deploy.py"
    script.write_text(SCRIPT, encoding="utf-8")
    # This returns when everybody who can write to the output has ended: the worker could.
    result = subprocess.run(
        [sys.executable, script],
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout.splitlines() == ["imported", "[ 2. -4.]"]
    assert result.stderr == ""

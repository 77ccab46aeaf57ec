"""What runs in the child process, run here."""

from __future__ import annotations

import os
import pickle
from multiprocessing.connection import Connection

import numpy as np
import pytest

from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.closed_loop import Crossing
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.comparison.worker import Bench, Decide, Drive, Mode, Order, Solve, serve

PLANAR = Contender("planar", Setting.TOLERANCE)
UNKNOWN = Contender("clarabel", Setting.DEFAULT)


def set_of(*problems: Problem) -> ProblemSet:
    return ProblemSet("hand", "", "m/s", problems, {})


def test_solvers_in_sequence_are_kept_and_cold_ones_are_new(feasible: Problem) -> None:
    bench = Bench([set_of(feasible)])
    tasks = {mode: Decide(0, 0, mode, [PLANAR]) for mode in Mode}
    kept = [bench._solvers(tasks[Mode.SEQUENCE], PLANAR, 1.0) for _ in range(2)]
    new = [bench._solvers(tasks[Mode.COLD], PLANAR, 1.0) for _ in range(2)]
    assert kept[0] is kept[1]
    assert new[0] is not new[1]
    for task in tasks.values():
        (attempt,) = bench.replies(task)
        assert isinstance(attempt, Attempt)
        assert attempt.is_own
        # Nobody told it the right answer.
        assert np.isnan(attempt.off)


def test_answers_are_found_on_request(empty: Problem) -> None:
    (truth,) = Bench([set_of(empty)]).replies(Solve(0, 0))
    assert isinstance(truth, Truth)
    assert truth.margin == 0.5


def test_robots_are_driven_on_request() -> None:
    (crossing,) = Bench([]).replies(Drive(PLANAR, True, 2))
    assert isinstance(crossing, Crossing)
    assert crossing.is_verified


@pytest.fixture
def pipes() -> tuple[Connection, Connection, int, int]:
    """The parent's ends, and the numbers of the child's."""
    to_read, child_write = os.pipe()
    child_read, to_write = os.pipe()
    orders, replies = Connection(to_write, readable=False), Connection(to_read, writable=False)
    return orders, replies, child_read, child_write


def test_replies_come_one_by_one_until_the_pipe_closes(
    pipes: tuple[Connection, Connection, int, int],
    feasible: Problem,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    orders, replies, child_read, child_write = pipes
    # Here the process goes on.
    monkeypatch.setattr("gc.disable", lambda: None)
    monkeypatch.setattr("gc.freeze", lambda: None)
    orders.send_bytes(pickle.dumps(Order([set_of(feasible)], {})))
    orders.send(Decide(0, 0, Mode.COLD, [PLANAR, UNKNOWN]))
    orders.send(Solve(0, 0))
    orders.close()
    serve(child_read, child_write)
    assert replies.recv() == "ready"
    first, second, third = (replies.recv() for _ in range(3))
    assert first.fate is second.fate is Fate.ANSWERED
    assert third.point.tolist() == [0.5, 0.0]
    with pytest.raises(EOFError):
        replies.recv()
    replies.close()

"""The process that contenders work in: late, dead, and replaced."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.comparison.worker import Decide, Mode, Order, Solve
from safefilter.comparison.worker_process import WorkerProcess

PATIENCE = 60.0
PLANAR = Contender("planar", Setting.TOLERANCE)


@pytest.fixture
def worker(feasible: Problem) -> Iterator[WorkerProcess]:
    made = WorkerProcess(Order([ProblemSet("hand", "", "m/s", (feasible,), {})], {}))
    yield made
    made.end()


def test_tasks_are_answered_also_after_it_was_late_or_died(worker: WorkerProcess) -> None:
    # It cannot answer while it is stopped, however fast it is.
    worker._child.end.peek()[2][0].send_signal(signal.SIGSTOP)  # type: ignore[index]  # it is alive
    worker.send(Solve(0, 0))
    assert worker.reply(0.0) is Fate.LATE
    worker.send(Solve(0, 0))
    assert isinstance(worker.reply(PATIENCE), Truth)
    # Found dead when it is handed something, or while it is waited for.
    process = worker._child.end.peek()[2][0]  # type: ignore[index]  # it is alive
    process.kill()
    process.wait()
    worker.send(Decide(0, 0, Mode.COLD, [PLANAR]))
    answer = worker.reply(PATIENCE)
    if answer is Fate.KILLED:
        # The pipe had taken the task all the same.
        worker.send(Decide(0, 0, Mode.COLD, [PLANAR]))
        answer = worker.reply(PATIENCE)
    assert isinstance(answer, Attempt)
    assert answer.fate is Fate.ANSWERED

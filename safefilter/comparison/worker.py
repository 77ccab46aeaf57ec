"""What runs in the child process: contenders on problems, timed, one at a time.

The garbage collector is off while contenders work, and runs between tasks. Whatever kills this process kills nothing
else: `safefilter.comparison.runner` starts another and goes on.
"""

from __future__ import annotations

import gc
import pickle
from collections.abc import Mapping, Sequence
from enum import Enum
from multiprocessing.connection import Connection
from time import perf_counter
from typing import NamedTuple, TypeAlias

from safefilter.backend_answer import Solvers
from safefilter.backends.registry import Factory, is_registered, register_backend
from safefilter.comparison.attempt import Attempt, Fate, decide, judge
from safefilter.comparison.closed_loop import Crossing, drive_across
from safefilter.comparison.contender import Contender, accuracy_of, make_contender
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import ProblemSet, Truth
from safefilter.errors import SafeFilterError, UnsupportedProgram


class Mode(Enum):
    """How solvers are asked; the value is the sentence to print."""

    COLD = "a new solver for each problem, setting up included"
    SEQUENCE = "one solver for all problems in their order, workspaces and warm starts kept"


class Decide(NamedTuple):
    """Let contenders decide one problem, in this order."""

    problems: int
    number: int
    mode: Mode
    contenders: Sequence[Contender]


class Drive(NamedTuple):
    """Let a contender drive robots across."""

    contender: Contender
    is_verified: bool
    num_steps: int


class Solve(NamedTuple):
    """Find the right answer to a problem."""

    problems: int
    number: int


Task: TypeAlias = Decide | Drive | Solve
Reply: TypeAlias = Attempt | Crossing | Truth | str


class Order(NamedTuple):
    """What the child begins with."""

    sets: Sequence[ProblemSet]
    factories: Mapping[str, Factory]


class Bench:
    """Carries out tasks; keeps the solvers that work in sequence."""

    def __init__(self, sets: Sequence[ProblemSet]) -> None:
        self._sets = sets
        self._kept: dict[tuple[Contender, int, float], Solvers] = {}

    def replies(self, task: Task) -> list[Reply]:
        """Carry out a task whose replies need not come one by one."""
        if isinstance(task, Drive):
            return [
                drive_across(task.contender, is_verified=task.is_verified, num_steps=task.num_steps)
            ]
        if isinstance(task, Solve):
            problem = self._sets[task.problems].problems[task.number]
            return [truth_of(problem, accuracy_of(problem.scale))]
        return [self.attempt(task, contender) for contender in task.contenders]

    def attempt(self, task: Decide, contender: Contender) -> Attempt:
        """Let one contender decide."""
        problems = self._sets[task.problems]
        problem, truth = problems.problems[task.number], problems.truths.get(task.number)
        start = perf_counter()
        try:
            solvers = self._solvers(task, contender, problem.scale)
        except UnsupportedProgram:
            return Attempt(Fate.UNSUPPORTED)
        made = perf_counter() - start
        return judge(decide(solvers, problem, start), problem, truth, made)

    def _solvers(self, task: Decide, contender: Contender, scale: float) -> Solvers:
        if task.mode is Mode.COLD:
            return make_contender(contender, scale)
        # Each set has solvers of its own: what they keep is of the problem before, and not of another set's.
        key = contender, task.problems, scale
        if key not in self._kept:
            self._kept[key] = make_contender(contender, scale)
        return self._kept[key]


def serve(read: int, write: int) -> None:
    """Work in the child until the pipe closes."""
    orders, replies = Connection(read, writable=False), Connection(write, readable=False)
    order: Order = pickle.loads(orders.recv_bytes())  # written by our own parent process
    for name, factory in order.factories.items():
        # Loading the file that a factory is in may have registered it.
        if not is_registered(name):
            register_backend(name, factory)
    bench = Bench(order.sets)
    gc.collect()
    gc.freeze()
    gc.disable()
    replies.send("ready")
    while True:
        try:
            task: Task = orders.recv()
        except EOFError:
            return
        _carry_out(bench, task, replies)
        gc.collect()


def _carry_out(bench: Bench, task: Task, replies: Connection) -> None:
    if isinstance(task, Decide):
        # One by one: who is working when the process hangs or dies is the one whose reply is missing.
        for contender in task.contenders:
            replies.send(bench.attempt(task, contender))
        return
    try:
        answers = bench.replies(task)
    except (SafeFilterError, ArithmeticError, ValueError, RuntimeError) as error:
        answers = [f"{type(error).__name__}: {error}"]
    for answer in answers:
        replies.send(answer)

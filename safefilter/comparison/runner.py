"""compare_backends: every contender on every problem, in turns, in a process that may hang or die.

In each round every problem goes to all contenders before the next problem does, in an order that changes from problem
to problem: a busy moment of the machine falls on all of them. What hangs or dies does not stop the run.

Times in s.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import monotonic
from typing import NamedTuple

from safefilter.arguments import require_kind, require_kinds
from safefilter.backends.registry import backend_factory, is_registered
from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.closed_loop import Crossing
from safefilter.comparison.contender import Contender
from safefilter.comparison.machine import describe_machine
from safefilter.comparison.problem import ProblemSet, Truth
from safefilter.comparison.worker import Decide, Drive, Mode, Order, Reply, Solve, Task
from safefilter.comparison.worker_process import START_SECONDS, WorkerProcess
from safefilter.errors import InvalidInput

PACKAGES = (
    "safefilter", "numpy", "numba", "scipy", "osqp", "clarabel", "cvxpy", "qpsolvers", "daqp", "highspy", "piqp",
    "proxsuite", "quadprog", "scs",
)  # fmt: skip
# A contender that was late or dead so often is not asked any more: each time costs the time limit and a new process.
MOST_STRIKES = 3
TRUTH_SECONDS = 20.0
LOOP_SECONDS = 120.0
LOOP_STEPS = 120
# Part of the time of a run that decisions get; crossings get the rest.
FOR_DECISIONS = 0.75

Key = tuple[Contender, Mode, str]
Progress = Callable[[int, int, str], None]


class Plan(NamedTuple):
    """How much is measured.

    Attributes:
        rounds: Rounds in sequence; there is one cold round.
        time_limit: Seconds that a decision may take.
        loop_steps: Steps of each crossing at most; 0 for none.
        has_all_loops: Does every setting of a backend cross, trusted? The first one only otherwise.
        seconds: When the run is cut short, in s from the end of warming up, which compiles in a fresh installation;
            decisions get the first three quarters, crossings the rest.
        num_warm_up: Problems of each set that solvers are warmed up on.
        num_cold: Problems of each set that new solvers are asked; None for all.
    """

    rounds: int = 3
    time_limit: float = 5.0
    loop_steps: int = LOOP_STEPS
    has_all_loops: bool = True
    seconds: float = math.inf
    num_warm_up: int = 2
    num_cold: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """All that was measured.

    Attributes:
        machine: What it ran on.
        plan: How much was measured.
        sets: The problem sets, right answers included.
        contenders: Who took part.
        attempts: By contender, mode and name of the set: one attempt a problem and round.
        crossings: By contender: trusted and verified, as far as they came to an end.
        left_out: How many tasks were left out because the run was cut short.
        seconds: What the run took.
    """

    machine: Mapping[str, str]
    plan: Plan
    sets: tuple[ProblemSet, ...]
    contenders: tuple[Contender, ...]
    attempts: Mapping[Key, Sequence[Attempt]]
    crossings: Mapping[Contender, Sequence[Crossing]]
    left_out: int
    seconds: float


def compare_backends(
    sets: Iterable[ProblemSet],
    contenders: Iterable[Contender],
    plan: Plan | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Run all contenders on all problems.

    Args:
        sets: Problems.
        contenders: See `contenders_of`.
        plan: How much is measured.
        progress: Told of each task: how many are done, how many there are, and what is next.

    Raises:
        InvalidInput: If there are no problems or no contenders, one of them is something else, two sets have one name,
            or a backend that was registered cannot be sent to another process.
    """
    run = _Run(
        require_kinds(sets, "sets", ProblemSet),
        require_kinds(contenders, "contenders", Contender),
        Plan() if plan is None else require_kind(plan, "plan", Plan),
        progress or _say_nothing,
    )
    return run.result()


class _Run:
    """State of one run."""

    def __init__(
        self,
        sets: tuple[ProblemSet, ...],
        contenders: tuple[Contender, ...],
        plan: Plan,
        progress: Progress,
    ) -> None:
        names = [problems.name for problems in sets]
        if not sets or not contenders or len(set(names)) < len(names):
            raise InvalidInput(
                f"compare: expected problem sets of different names and contenders, got {names} and "
                f"{[contender.title for contender in contenders]}"
            )
        self._machine = describe_machine(PACKAGES)
        self._start, self._measured_from = monotonic(), math.inf
        self._sets, self._contenders, self._plan = list(sets), contenders, plan
        self._progress = progress
        self._strikes: dict[Contender, int] = defaultdict(int)
        self._attempts: dict[Key, list[Attempt]] = defaultdict(list)
        self._crossings: dict[Contender, list[Crossing]] = defaultdict(list)
        self._worker = WorkerProcess(self._order())

    def result(self) -> Comparison:
        """Carry everything out."""
        try:
            self._find_truths()
            tasks = [*self._decisions(), *self._drives()]
            left_out = 0
            for done, (task, is_counted) in enumerate(tasks):
                self._progress(done, len(tasks), self._title(task))
                if is_counted and math.isinf(self._measured_from):
                    self._measured_from = monotonic()
                if self._is_late(task):
                    left_out += 1
                elif isinstance(task, Decide):
                    self._decide(task, is_counted=is_counted)
                else:
                    self._drive(task)
        finally:
            self._worker.end()
        return Comparison(
            machine=self._machine,
            plan=self._plan,
            sets=tuple(self._sets),
            contenders=self._contenders,
            attempts=dict(self._attempts),
            crossings=dict(self._crossings),
            left_out=left_out,
            seconds=monotonic() - self._start,
        )

    def _is_late(self, task: Task) -> bool:
        share = FOR_DECISIONS if isinstance(task, Decide) else 1.0
        return monotonic() - self._measured_from > share * self._plan.seconds

    def _find_truths(self) -> None:
        """Right answers that are not known yet; those that take too long stay unknown."""
        for number, problems in enumerate(self._sets):
            found: dict[int, Truth] = dict(problems.truths)
            missing = [k for k in range(len(problems)) if k not in found]
            for k in missing:
                self._progress(k, len(problems), f"exact answers of {problems.name}")
                reply = self._ask(Solve(number, k), TRUTH_SECONDS)
                if isinstance(reply, Truth):
                    found[k] = reply
            self._sets[number] = replace(problems, truths=found)
            if missing:
                # The process has the sets that it was started with.
                self._worker.replace(self._order())

    def _order(self) -> Order:
        names = {contender.backend for contender in self._contenders}
        factories = {name: backend_factory(name) for name in sorted(names) if is_registered(name)}
        return Order(self._sets, factories)

    def _ask(self, task: Task, seconds: float) -> Reply | Fate:
        """One task with one reply."""
        self._worker.send(task)
        return self._worker.reply(seconds)

    def _decisions(self) -> list[tuple[Task, bool]]:
        """Tasks, and whether they count; sets take turns, so that a run that is cut short has seen some of each."""
        tasks: list[tuple[Task, bool]] = [(task, False) for task in self._warm_up()]
        longest = max(len(problems) for problems in self._sets)
        num_cold = self._plan.num_cold
        for turn in range(self._plan.rounds):
            for k in range(longest):
                for number in range(len(self._sets)):
                    if k < len(self._sets[number]):
                        order = self._turned(k + turn)
                        is_cold = turn == 0 and (num_cold is None or k < num_cold)
                        modes = (Mode.COLD, Mode.SEQUENCE) if is_cold else (Mode.SEQUENCE,)
                        tasks += [(Decide(number, k, mode, order), True) for mode in modes]
        return tasks

    def _warm_up(self) -> list[Decide]:
        """The first problems of each set; cold only once: nothing is kept there but what is imported and compiled."""
        tasks = []
        for number, problems in enumerate(self._sets):
            modes = Mode if number == 0 else (Mode.SEQUENCE,)
            size = min(self._plan.num_warm_up, len(problems))
            tasks += [
                Decide(number, k, mode, self._contenders) for mode in modes for k in range(size)
            ]
        return tasks

    def _drives(self) -> list[tuple[Task, bool]]:
        steps = self._plan.loop_steps
        if not steps:
            return []
        # Verified, all settings are one: the filter asks for its own.
        names = dict.fromkeys(contender.backend for contender in self._contenders)
        one = {name: next(c for c in self._contenders if c.backend == name) for name in names}
        trusted = self._contenders if self._plan.has_all_loops else tuple(one.values())
        tasks: list[tuple[Task, bool]] = [(Drive(c, False, steps), True) for c in trusted]
        return tasks + [(Drive(contender, True, steps), True) for contender in one.values()]

    def _turned(self, turn: int) -> tuple[Contender, ...]:
        """All contenders, another one first each time, and every second time backwards."""
        first = turn % len(self._contenders)
        order = self._contenders[first:] + self._contenders[:first]
        return order if turn % 2 == 0 else order[::-1]

    def _decide(self, task: Decide, *, is_counted: bool) -> None:
        name = self._sets[task.problems].name
        left = [c for c in task.contenders if self._strikes[c] < MOST_STRIKES]
        replies: dict[Contender, Attempt] = {}
        while left:
            self._worker.send(task._replace(contenders=tuple(left)))
            # Warming up includes imports and compiling.
            seconds = (
                self._plan.time_limit if is_counted else max(START_SECONDS, self._plan.time_limit)
            )
            while left:
                contender, reply = left.pop(0), self._worker.reply(seconds)
                if isinstance(reply, Attempt):
                    replies[contender] = reply
                    continue
                fate = reply if isinstance(reply, Fate) else Fate.KILLED
                replies[contender] = Attempt(fate)
                self._strikes[contender] += 1
                if is_counted:
                    # The process is a new one.
                    self._decide(task._replace(number=0, contenders=tuple(left)), is_counted=False)
                    left = [c for c in left if self._strikes[c] < MOST_STRIKES]
                break
        if is_counted:
            for contender in task.contenders:
                attempt = replies.get(contender, Attempt(Fate.STRUCK))
                self._attempts[contender, task.mode, name].append(attempt)

    def _drive(self, task: Task) -> None:
        if isinstance(task, Drive) and self._strikes[task.contender] < MOST_STRIKES:
            reply = self._ask(task, LOOP_SECONDS)
            if isinstance(reply, Crossing):
                self._crossings[task.contender].append(reply)

    def _title(self, task: Task) -> str:
        if isinstance(task, Drive):
            return f"crossing: {task.contender.title}"
        return f"{self._sets[task.problems].name}: {task.number}"


def _say_nothing(_done: int, _total: int, _title: str) -> None:
    pass

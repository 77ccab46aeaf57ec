"""Processes that drive cases: one hands out numbers and writes the log, the others drive.

Whoever drives holds no file, so that killing any process at any moment, by any signal, leaves the log whole: a case is
either on disk or driven again. Those who drive end with the case they are at when the one who asks is gone.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import NamedTuple

import numba

from assurance.stress.case_log import CaseLog
from assurance.stress.cases import Campaign, Result, replay, run_case
from assurance.stress.kinds import CYCLE
from safefilter.errors import OutOfRange, SafeFilterError


class DriverDied(SafeFilterError, RuntimeError):
    """A process ended in the middle of a case."""


class Driver(NamedTuple):
    """A process that drives cases.

    Attributes:
        process: Itself.
        pipe: Numbers go there, results come back.
    """

    process: BaseProcess
    pipe: Connection


def drive_cases(
    log: CaseLog, campaign: Campaign, processes: int, watch: Callable[[Result], object], steps: int
) -> None:
    """Drive cases that the log does not hold, from number 0 on, until it holds so many robot-steps of every kind.

    Numbers are handed out in order, and those begun are finished: a campaign that has ended holds the cases from 0 to
    its last one without a gap.

    Args:
        log: Where results go, each as soon as it is there.
        campaign: Which one.
        processes: How many drive at the same time; 1 drives here.
        watch: Told of each result.
        steps: Robot-steps wanted, those in the log included; one cycle of kinds is driven in any case.

    Raises:
        OutOfRange: If there is no process.
        DriverDied: If one of them ended; what is in the log stays there.
    """
    if processes < 1:
        raise OutOfRange(f"processes: expected 1 or more, got {processes}")
    results = log.entries.results

    def note(result: Result) -> None:
        log.note(result)
        watch(result)

    # Processes that compile one kernel at the same time can swap each other's files: one case of each kind here first.
    for number in sorted(map(CYCLE.index, set(CYCLE))):
        if number not in results:
            note(run_case(campaign, number))
    made = sum(result.tally.robot_steps for result in results.values())
    # What a run that was killed left open before its last case is filled in, however many steps there are.
    least = max(len(CYCLE), *results, 0)
    missing = _missing(results)
    with _crew(campaign, processes) as crew:
        number = next(missing)
        while made < steps or number < least or crew.is_busy:
            while (made < steps or number < least) and crew.has_room:
                crew.begin(number)
                number = next(missing)
            for result in crew.finished():
                note(result)
                made += result.tally.robot_steps


def serve(pipe: Connection, campaign: Campaign) -> None:
    """Drive what is asked for, until nobody asks any more."""
    # Ctrl-C goes to all processes of a terminal: the one who asks decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    numba.set_num_threads(1)
    try:
        while True:
            pipe.send(run_case(campaign, pipe.recv()))
    except (EOFError, BrokenPipeError):
        return


def _missing(results: dict[int, Result]) -> Iterator[int]:
    """Numbers without a result, in order; asked again, the next ones, whatever has become of those before."""
    there = frozenset(results)
    return (number for number in count() if number not in there)


class Crew:
    """Those who drive, and what each of them is at; without anybody, cases are driven here."""

    def __init__(self, campaign: Campaign, drivers: tuple[Driver, ...]) -> None:
        self._campaign, self._drivers = campaign, drivers
        self._at: dict[int, int] = {}
        self._here: list[int] = []

    @property
    def is_busy(self) -> bool:
        """Is anything being driven?"""
        return bool(self._at or self._here)

    @property
    def has_room(self) -> bool:
        """Can another case begin?"""
        return len(self._at) < len(self._drivers) or not (self._drivers or self._here)

    def begin(self, number: int) -> None:
        """Begin a case."""
        if not self._drivers:
            self._here.append(number)
            return
        free = next(k for k in range(len(self._drivers)) if k not in self._at)
        self._at[free] = number
        # Whoever has died is noticed where results are waited for.
        with suppress(BrokenPipeError, ConnectionResetError):
            self._drivers[free].pipe.send(number)

    def finished(self) -> Iterator[Result]:
        """Wait for at least one case to end."""
        while self._here:
            yield run_case(self._campaign, self._here.pop())
        if not self._at:
            # Waiting for nobody would last for ever.
            return
        ready = wait([self._drivers[k].pipe for k in self._at])
        for k in [k for k in self._at if self._drivers[k].pipe in ready]:
            yield self._received(k)
            del self._at[k]

    def _received(self, k: int) -> Result:
        process, pipe = self._drivers[k]
        try:
            result: Result = pipe.recv()
        except (EOFError, ConnectionResetError) as error:
            process.join()
            raise DriverDied(
                f"the process that drove case {self._at[k]} ended with exit code {process.exitcode}; drive it alone: "
                f"{replay(self._campaign, self._at[k])}; the same command as before goes on"
            ) from error
        return result


@contextmanager
def _crew(campaign: Campaign, processes: int) -> Iterator[Crew]:
    if processes == 1:
        yield Crew(campaign, ())
        return
    # Fresh processes: forked ones would share the state of thread pools that do not survive it.
    context = multiprocessing.get_context("spawn")
    drivers = list[Driver]()
    try:
        for _ in range(processes):
            ours, theirs = context.Pipe()
            process: BaseProcess = context.Process(
                target=serve, args=(theirs, campaign), daemon=True
            )
            process.start()
            theirs.close()
            drivers.append(Driver(process, ours))
        yield Crew(campaign, tuple(drivers))
    finally:
        for process, pipe in drivers:
            pipe.close()
            process.terminate()
            process.join()

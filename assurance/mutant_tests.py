"""The tests of one module as a plugin of pytest: collected once, run against one mutant after the other.

The process that has collected them runs none itself. It forks: first for a run without any mistake, which tells how
long each test takes and which lines it comes to, then for each mutant.
"""

from __future__ import annotations

import ast
import itertools
import json
import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from types import ModuleType

import pytest

from assurance.mutants import Mutant
from assurance.swapping import swap_source

# A mutant that makes a loop endless is killed after so many times what the tests take without it, plus some, in s of
# CPU; or after this in s, if it sleeps.
PATIENCE, PATIENCE_TIMES, SLEEP = 20.0, 5.0, 1800.0
SURVIVED, KILLED, UNCHANGED = 0, 1, 3


@dataclass(frozen=True, slots=True)
class Run:
    """What a test did without any mistake: its result, time in s, and the lines of the module that it came to."""

    passed: bool
    seconds: float
    lines: frozenset[int]


class MutantTests:
    """Runs some mutants as soon as pytest has collected the tests.

    Attributes:
        failing: A test that fails without any mistake: nothing was run then.
    """

    def __init__(
        self, module: str, mutants: Mapping[str, Mutant], note: Callable[[str, str], bool]
    ) -> None:
        """Take what to run.

        Args:
            module: Name of the module that has them.
            mutants: By a name of one's choice.
            note: Told that name and "killed", "survived", "timed out", or "the same" if no function and no constant
                of the module came out different. Returns whether to go on.
        """
        self._name, self._mutants, self._note = module, mutants, note
        self.failing = ""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the mutants, and let pytest run nothing."""
        module = import_module(self._name)
        runs = run_unchanged(module, session.items)
        self.failing = next((name for name, run in runs.items() if not run.passed), "")
        if self.failing or session.testsfailed:
            self.failing = self.failing or "a file of tests"
            return True
        source = Path(str(module.__file__)).read_text(encoding="utf-8")
        for key, mutant in self._mutants.items():
            chosen = choose_tests(session.items, runs, lines_of_statement(source, mutant.line))
            patience = PATIENCE + PATIENCE_TIMES * sum(runs[item.nodeid].seconds for item in chosen)
            if not self._note(key, run_mutant(module, mutant, chosen, patience)):
                break
        return True


def run_unchanged(module: ModuleType, items: Sequence[pytest.Item]) -> dict[str, Run]:
    """Run all tests in a process of its own, without any mistake."""
    receive, send = Pipe(duplex=False)
    child = os.fork()
    if child == 0:
        _be_the_process_without_mistake(module, items, send)
    send.close()
    try:
        found: dict[str, tuple[bool, float, list[int]]] = json.loads(receive.recv_bytes())
    except EOFError:
        found = {item.nodeid: (False, 0.0, []) for item in items}
    os.waitpid(child, 0)
    return {name: Run(passed, s, frozenset(lines)) for name, (passed, s, lines) in found.items()}


def _be_the_process_without_mistake(
    module: ModuleType, items: Sequence[pytest.Item], send: Connection
) -> None:
    import coverage  # noqa: PLC0415  # traces from here on

    _silence()
    traced = coverage.Coverage(data_file=None, include=[str(module.__file__)], config_file=False)
    traced.start()
    found: dict[str, tuple[bool, float, list[int]]] = {}
    for item, outcome in run_tests(items, lambda item: traced.switch_context(item.nodeid)):
        found[item.nodeid] = (outcome[0], outcome[1], [])
    traced.stop()
    data = traced.get_data()
    for file in data.measured_files():
        for line, names in data.contexts_by_lineno(file).items():
            for name in filter(None, names):
                found[name][2].append(line)
    send.send_bytes(json.dumps(found).encode())
    os._exit(0)


def run_mutant(
    module: ModuleType, mutant: Mutant, items: Sequence[pytest.Item], patience: float
) -> str:
    """Run tests against a mutant in a process of its own, until one fails.

    Args:
        module: What has the mistake.
        mutant: The mistake.
        items: Tests, in the order in which they run.
        patience: After so much CPU the process is stopped, in s.
    """
    child = os.fork()
    if child == 0:
        _be_the_process_of(module, mutant, items, patience)
    deadline = time.monotonic() + SLEEP
    while time.monotonic() < deadline:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            names = {SURVIVED: "survived", UNCHANGED: "the same", -signal.SIGXCPU: "timed out"}
            return names.get(code, "killed")
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "timed out"


def _be_the_process_of(
    module: ModuleType, mutant: Mutant, items: Sequence[pytest.Item], patience: float
) -> None:
    _silence()
    # Whatever the mistake makes of this process, it counts as noticed, and the process ends here.
    code = KILLED
    try:
        soft = int(time.process_time() + patience) + 1
        # At the soft limit SIGXCPU says what happened; at the hard one it would be killed like any other.
        resource.setrlimit(resource.RLIMIT_CPU, (soft, soft + 10))
        if swap_source(module, mutant.source) == 0:
            code = UNCHANGED
        elif all(passed for _, (passed, _) in run_tests(items)):
            code = SURVIVED
    finally:
        os._exit(code)


def run_tests(
    items: Sequence[pytest.Item], before: Callable[[pytest.Item], object] = lambda _: None
) -> Iterator[tuple[pytest.Item, tuple[bool, float]]]:
    """Run tests one by one, as pytest does.

    Yields:
        A test; whether it passed, or was skipped, and its time in s of CPU.
    """
    failures: list[str] = []

    class Listener:
        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                failures.append(report.nodeid)

    # None follows the last one, and nothing nothing.
    for item, following in itertools.zip_longest(items, items[1:]):
        if not item.config.pluginmanager.has_plugin("listener"):
            item.config.pluginmanager.register(Listener(), "listener")
        before(item)
        start = time.process_time()
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        yield item, (not failures, time.process_time() - start)


def choose_tests(
    items: Sequence[pytest.Item], runs: Mapping[str, Run], lines: frozenset[int]
) -> list[pytest.Item]:
    """Tests that come to some of these lines, quick ones first; all if nothing is known of any line."""
    chosen = [item for item in items if not lines or runs[item.nodeid].lines & lines]
    return sorted(chosen, key=lambda item: runs[item.nodeid].seconds)


def lines_of_statement(source: str, line: int) -> frozenset[int]:
    """Lines of the statement that a line is part of, of a branch or a loop its head; none outside functions."""
    found: frozenset[int] = frozenset()
    inside = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    for function in inside:
        for statement in (node for part in function.body for node in ast.walk(part)):
            if not isinstance(statement, ast.stmt):
                continue
            body = getattr(statement, "body", None)
            last = body[0].lineno - 1 if body else int(statement.end_lineno or statement.lineno)
            last = max(last, statement.lineno)
            if statement.lineno <= line <= last:
                # Walked from the outside in: the last one found is the innermost.
                found = frozenset(range(statement.lineno, last + 1))
    return found


def _silence() -> None:
    sys.stdout.flush()
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)

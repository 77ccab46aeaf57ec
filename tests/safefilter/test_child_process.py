"""A child process and two pipes: it works, it is ended, and nothing is left of it."""

from __future__ import annotations

import gc
import os
import pickle
from contextlib import suppress

import pytest

from safefilter.backends.child_process import ChildProcess
from safefilter.backends.planar import Planar

ORDER = pickle.dumps((Planar, 1e-9))
WORKER = "safefilter.backends.supervised"
PATIENCE = 60.0


def test_a_child_reads_orders_and_writes_replies() -> None:
    child = ChildProcess(WORKER, ORDER)
    assert child.replies.poll(PATIENCE)
    assert child.replies.recv() == "ready"
    child.end()
    assert not child.end.alive


def test_a_child_that_dies_is_the_end_of_its_replies(capfd: pytest.CaptureFixture[str]) -> None:
    child = ChildProcess("no_such_module", ORDER)
    assert child.replies.poll(PATIENCE)
    with pytest.raises(EOFError):
        child.replies.recv()
    child.end()
    assert "no_such_module" in capfd.readouterr().err


def test_nobody_needs_to_end_it() -> None:
    child = ChildProcess(WORKER, ORDER)
    process = child.end.peek()[2][0]  # type: ignore[index]  # it is alive
    del child
    gc.collect()
    assert process.poll() is not None
    with suppress(ProcessLookupError):
        os.kill(process.pid, 0)
        pytest.fail("the child is still there")

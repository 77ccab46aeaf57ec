"""A backend in a process of its own, which is ended if it is late: a hanging solver cannot be interrupted otherwise.

A thread would not do: a solver that keeps the interpreter lock stops the whole process. The worker is a plain child
that runs `serve`; unlike `multiprocessing`'s it does not import the caller's main script again.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import weakref
from collections.abc import Callable
from multiprocessing.connection import Connection
from time import monotonic

from safefilter.arrays import positive_number
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.errors import BackendFailed, InvalidInput, SafeFilterError
from safefilter.programs.convex_program import ConvexProgram

_SERVE = "from safefilter.backends.supervised import serve; serve({read}, {write})"
START_SECONDS = 120.0


class Supervised:
    """Wraps a backend; answers `Status.TIME_LIMIT` once the time since `start` is used up.

    Attributes:
        name: As the backend's.
        capabilities: As the backend's.
    """

    def __init__(
        self,
        backend: Backend,
        factory: Callable[[float], Backend],
        tolerance: float,
        deadline: float,
    ) -> None:
        """Start the worker and wait until it is ready.

        Args:
            backend: The backend, for its name and capabilities.
            factory: Makes it in the worker; a function or class that can be imported there.
            tolerance: Passed to the factory.
            deadline: Seconds from `start` on.

        Raises:
            InvalidInput: If the factory cannot be sent to another process.
            OutOfRange: If the deadline is not above zero.
            BackendFailed: If the worker does not come up.
        """
        self.name: str = backend.name
        self.capabilities: Capabilities = backend.capabilities
        self._deadline = positive_number(deadline, "deadline")
        try:
            self._order = pickle.dumps((factory, tolerance))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InvalidInput(
                f"deadline: backend {self.name!r} has to run in a process of its own, but its factory cannot be sent "
                f"there ({error}); use a function or class at the top level of a module"
            ) from None
        self._worker = Worker(self._order)
        self._is_waiting = False
        self._expires = monotonic() + START_SECONDS
        try:
            is_up = self._worker.is_ready(START_SECONDS)
        except EOFError:
            is_up = False
        if not is_up:
            self._worker.end()
            raise InvalidInput(
                f"deadline: the process for backend {self.name!r} does not come up; can "
                f"{factory!r} be imported outside of this process?"
            )

    def start(self) -> None:
        """Begin to count the deadline."""
        self._expires = monotonic() + self._deadline

    @property
    def is_late(self) -> bool:
        """Is the time used up?"""
        return monotonic() >= self._expires

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve within what is left of the deadline; see `Backend.solve`.

        Raises:
            BackendFailed: If the backend raised, or its process died.
        """
        asked = monotonic()
        try:
            reply = self._exchange(program)
        except (EOFError, OSError):
            self._restart()
            raise BackendFailed(f"{self.name}: its process died", program, Status.FAILED) from None
        if reply is None:
            self._restart()
            return Solution.without_point(program, Status.TIME_LIMIT, 0.0, monotonic() - asked)
        if isinstance(reply, str):
            raise BackendFailed(f"{self.name}: {reply}", program, Status.FAILED)
        return reply

    def _exchange(self, program: ConvexProgram) -> Solution | str | None:
        left = self._expires - monotonic()
        if left <= 0.0:
            # Nothing was asked: the worker may stay.
            return Solution.without_point(program, Status.TIME_LIMIT, 0.0, 0.0)
        if not self._worker.is_ready(left):
            return Solution.without_point(program, Status.TIME_LIMIT, 0.0, left)
        if self._is_waiting:
            # An exception from outside, such as Ctrl-C, came between the last question and its answer, which would now
            # be taken for the answer to this one.
            self._is_waiting = False
            return None
        self._is_waiting = True
        reply = self._worker.ask(program, self._expires)
        self._is_waiting = False
        return reply

    def _restart(self) -> None:
        self._worker.end()
        self._worker = Worker(self._order)
        self._is_waiting = False


class Worker:
    """The child process and the two pipes to it."""

    def __init__(self, order: bytes) -> None:
        """Start the child; it says when it is ready."""
        to_read, child_write = os.pipe()
        child_read, to_write = os.pipe()
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join(filter(None, sys.path)))
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVE.format(read=child_read, write=child_write)],
            pass_fds=(child_read, child_write),
            env=environment,
            stdin=subprocess.DEVNULL,
        )
        os.close(child_read)
        os.close(child_write)
        self._replies = Connection(to_read, writable=False)
        self._orders = Connection(to_write, readable=False)
        self._is_ready = False
        self.end = weakref.finalize(self, _end, self._process, self._replies, self._orders)
        self._orders.send_bytes(order)

    def is_ready(self, seconds: float) -> bool:
        """Is the backend made? Waits for it.

        Raises:
            EOFError: If the child died.
        """
        if not self._is_ready and self._replies.poll(max(0.0, seconds)):
            self._is_ready = self._replies.recv() == "ready"
        return self._is_ready

    def ask(self, program: ConvexProgram, expires: float) -> Solution | str | None:
        """Solution, the words of what was raised, or None if time is up."""
        self._orders.send((program.P, program.q, program.G, program.h))
        if not self._replies.poll(max(0.0, expires - monotonic())):
            return None
        reply: Solution | str = self._replies.recv()
        return reply


def _end(process: subprocess.Popen[bytes], replies: Connection, orders: Connection) -> None:
    process.kill()
    process.wait()
    replies.close()
    orders.close()


def serve(read: int, write: int) -> None:
    """Work in the child: make the backend, then answer programs until the pipe closes."""
    orders, replies = Connection(read, writable=False), Connection(write, readable=False)
    factory, tolerance = pickle.loads(orders.recv_bytes())  # written by our own parent process
    backend: Backend = factory(tolerance)
    replies.send("ready")
    while True:
        try:
            parts = orders.recv()
        except EOFError:
            return
        try:
            reply: Solution | str = backend.solve(ConvexProgram(*parts))
        except (
            SafeFilterError,
            ArithmeticError,
            LookupError,
            TypeError,
            ValueError,
            RuntimeError,
        ) as error:
            reply = f"{type(error).__name__}: {error}"
        replies.send(reply)

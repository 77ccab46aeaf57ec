"""A backend in a process of its own, which is ended if it is late: a hanging solver cannot be interrupted otherwise.

A thread would not do: a solver that keeps the interpreter lock stops the whole process.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from multiprocessing.connection import Connection
from time import monotonic

from safefilter.arrays import positive_number
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.child_process import ChildProcess
from safefilter.errors import BackendFailed, InvalidInput, SafeFilterError
from safefilter.programs.convex_program import ConvexProgram

SERVE = "safefilter.backends.supervised"
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
    """The process of a backend."""

    def __init__(self, order: bytes) -> None:
        """Start it; it says when it is ready."""
        self._child = ChildProcess(SERVE, order)
        self._is_ready = False
        self.end = self._child.end

    def is_ready(self, seconds: float) -> bool:
        """Is the backend made? Waits for it.

        Raises:
            EOFError: If the child died.
        """
        if not self._is_ready and self._child.replies.poll(max(0.0, seconds)):
            self._is_ready = self._child.replies.recv() == "ready"
        return self._is_ready

    def ask(self, program: ConvexProgram, expires: float) -> Solution | str | None:
        """Solution, the words of what was raised, or None if time is up."""
        self._child.orders.send((program.P, program.q, program.G, program.h))
        if not self._child.replies.poll(max(0.0, expires - monotonic())):
            return None
        reply: Solution | str = self._child.replies.recv()
        return reply


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

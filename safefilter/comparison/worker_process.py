"""The process that contenders work in, and what becomes of it: one that is late or dead is replaced by a new one."""

from __future__ import annotations

import pickle

from safefilter.backends.child_process import ChildProcess
from safefilter.comparison.attempt import Fate
from safefilter.comparison.worker import Order, Reply, Task
from safefilter.errors import InvalidInput

WORKER = "safefilter.comparison.worker"
# For a new process: imports, and kernels that have to be compiled.
START_SECONDS = 120.0


class WorkerProcess:
    """Takes tasks and gives replies, whatever happens to the process behind it."""

    def __init__(self, order: Order) -> None:
        """Start a process.

        Args:
            order: What it begins with.

        Raises:
            InvalidInput: If a backend cannot be sent there, or the process does not come up.
        """
        self._order = order
        self._child = self._new_child()

    def send(self, task: Task) -> None:
        """Hand a task over."""
        try:
            self._child.orders.send(task)
        except OSError:
            # It died after its last reply.
            self.replace(self._order)
            self._child.orders.send(task)

    def reply(self, seconds: float) -> Reply | Fate:
        """Wait for a reply; if none comes, say why: the process is then a new one, and knows of no task."""
        try:
            if self._child.replies.poll(seconds):
                reply: Reply = self._child.replies.recv()
                return reply
            fate = Fate.LATE
        except (EOFError, OSError):
            fate = Fate.KILLED
        self.replace(self._order)
        return fate

    def replace(self, order: Order) -> None:
        """Start anew."""
        self.end()
        self._order = order
        self._child = self._new_child()

    def end(self) -> None:
        """End the process."""
        self._child.end()

    def _new_child(self) -> ChildProcess:
        names = sorted(self._order.factories)
        try:
            parcel = pickle.dumps(self._order)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InvalidInput(
                f"compare: backends {names} have to run in a process of their own, but a factory cannot be sent there "
                f"({error}); use functions or classes at the top level of a module"
            ) from None
        child = ChildProcess(WORKER, parcel)
        try:
            is_up = child.replies.poll(START_SECONDS) and child.replies.recv() == "ready"
        except EOFError:
            is_up = False
        if not is_up:
            child.end()
            raise InvalidInput(
                "compare: the process that solvers work in does not come up; can the factories of backends "
                f"{names} be imported outside of this process?"
            )
        return child

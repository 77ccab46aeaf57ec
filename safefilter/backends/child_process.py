"""A child process and two pipes to it; unlike `multiprocessing`'s it does not import the caller's main script again."""

from __future__ import annotations

import os
import subprocess
import sys
import weakref
from multiprocessing.connection import Connection

_CODE = "from {module} import serve; serve({read}, {write})"


class ChildProcess:
    """Runs ``serve(read, write)`` of a module of this package, with the numbers of its ends of the pipes.

    Attributes:
        orders: To write to; the first thing in it is the order that the child is made with.
        replies: To read from; raises `EOFError` if the child died.
        end: Kills the child and closes the pipes. Called when nobody needs it any more.
    """

    def __init__(self, module: str, order: bytes) -> None:
        """Start the child.

        Args:
            module: Where ``serve`` is.
            order: Sent as bytes, for the child to begin with.
        """
        to_read, child_write = os.pipe()
        child_read, to_write = os.pipe()
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join(filter(None, sys.path)))
        process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                _CODE.format(module=module, read=child_read, write=child_write),
            ],
            pass_fds=(child_read, child_write),
            env=environment,
            stdin=subprocess.DEVNULL,
        )
        os.close(child_read)
        os.close(child_write)
        self.replies = Connection(to_read, writable=False)
        self.orders = Connection(to_write, readable=False)
        self.end = weakref.finalize(self, _end, process, self.replies, self.orders)
        self.orders.send_bytes(order)


def _end(process: subprocess.Popen[bytes], replies: Connection, orders: Connection) -> None:
    process.kill()
    process.wait()
    replies.close()
    orders.close()

"""Run a kernel over ranges of a batch on all threads.

Kernels release the interpreter lock, so plain threads do. Each range writes its own rows of the output, so results do
not depend on the number of threads. The number is numba's (`numba.set_num_threads`, NUMBA_NUM_THREADS).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

import numba

# A thread costs some 50 us to wake: below this many items a batch stays on the caller's thread.
MIN_ITEMS = 256
# More ranges than threads, because dense parts of a crowd take longer than its fringe.
RANGES_PER_THREAD = 4

_pools: dict[int, ThreadPoolExecutor] = {}
# Threads do not survive a fork: the child makes its own.
if hasattr(os, "register_at_fork"):  # not on Windows, which does not fork
    os.register_at_fork(after_in_child=_pools.clear)


def over_ranges(
    work: Callable[[int, int], object],
    num_items: int,
    *,
    ranges_per_thread: int = RANGES_PER_THREAD,
) -> None:
    """Call ``work(first, last)`` for ranges that cover ``num_items``, in parallel where that pays.

    What ``work`` raises is raised here, once no range is being worked on any more.

    Args:
        work: What to do with a range.
        num_items: How many items there are.
        ranges_per_thread: More even out items that differ; fewer cost fewer calls, one at a time, of ``work``.
    """
    # Asking numba takes a microsecond: not for a batch too small.
    num_threads = numba.get_num_threads() if num_items >= MIN_ITEMS else 1
    if num_threads == 1:
        work(0, num_items)
        return
    pool = _pools.get(num_threads)
    if pool is None:
        pool = _pools[num_threads] = ThreadPoolExecutor(num_threads, "safefilter")
    size = -(-num_items // (ranges_per_thread * num_threads))
    starts = range(0, num_items, size)
    futures = [pool.submit(work, first, min(first + size, num_items)) for first in starts]
    wait(futures)
    for future in futures:
        future.result()

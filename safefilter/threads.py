"""Run a kernel over ranges of a batch on as many threads as the work is worth.

Kernels release the interpreter lock, so plain threads do. Each range writes its own rows of the output, so results do
not depend on the number of threads. The number is numba's (`numba.set_num_threads`, NUMBA_NUM_THREADS), at most: the
caller works on the first range alone, and only if the rest would take long enough does it ask others to help. It never
waits for a helper that has not begun: on a busy machine it does the work itself.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from time import perf_counter

import numba

# Below this many items the caller does not even look at the clock: each would have to take 8 us for that to pay.
MIN_ITEMS = 128
# Part of the items in the first range, from which the time that the rest takes is known.
FIRST_PART = 1 / 16
# For less work than this nobody is asked. A helper begins some 50 us after it is asked, and on a busy machine it may be
# put aside for a millisecond or more in the middle of a range, which the caller then waits for.
WORTH_SHARING = 1e-3  # s
# More ranges than threads, because dense parts of a crowd take longer than its fringe.
RANGES_PER_THREAD = 4

_pools: dict[int, ThreadPoolExecutor] = {}
# Threads do not survive a fork: the child makes its own.
if hasattr(os, "register_at_fork"):  # not on Windows, which does not fork
    os.register_at_fork(after_in_child=_pools.clear)


def over_ranges(work: Callable[..., object], num_items: int, *given: object) -> None:
    """Call ``work(*given, first, last)`` for ranges that cover ``num_items``, in parallel where that pays.

    What ``work`` raises is raised here, once no range is being worked on any more; ranges not begun are left out then.
    """
    # Asking numba takes a microsecond: not for a batch too small.
    num_threads = numba.get_num_threads() if num_items >= MIN_ITEMS else 1
    if num_threads == 1:
        work(*given, 0, num_items)
        return
    done = max(1, int(FIRST_PART * num_items))
    start = perf_counter()
    work(*given, 0, done)
    rest = (perf_counter() - start) * (num_items - done) / done
    if rest < WORTH_SHARING:
        work(*given, done, num_items)
        return
    _share(partial(work, *given), done, num_items, num_threads)


def over_worlds(
    work: Callable[..., object], num_worlds: int, num_robots: int, *given: object
) -> None:
    """Call ``work(*given, first, last)`` for ranges of worlds, in parallel where there are robots enough to pay."""
    # Few worlds are short: a microsecond less than by way of ranges.
    if num_worlds * num_robots < MIN_ITEMS:
        work(*given, 0, num_worlds)
        return
    # Ranges are of robots, and a world belongs to that of its first one.
    over_ranges(
        lambda first, last: work(*given, -(-first // num_robots), -(-last // num_robots)),
        num_worlds * num_robots,
    )


def _share(work: Callable[[int, int], object], done: int, num_items: int, num_threads: int) -> None:
    """Work on the items from ``done`` on together with helpers."""
    pool = _pools.get(num_threads)
    if pool is None:
        pool = _pools[num_threads] = ThreadPoolExecutor(num_threads - 1, "safefilter")
    size = -(-(num_items - done) // (RANGES_PER_THREAD * num_threads))
    starts = deque(range(done, num_items, size))

    def take_ranges() -> None:
        # Two threads may see the last one left, and a deque gives it to one of them.
        while starts:
            try:
                first = starts.popleft()
            except IndexError:
                return
            work(first, min(first + size, num_items))

    helpers = [pool.submit(take_ranges) for _ in range(num_threads - 1)]
    try:
        take_ranges()
    finally:
        starts.clear()
        begun = [helper for helper in helpers if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()

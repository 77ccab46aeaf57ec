"""Ranges cover a batch once, whatever the number of threads; errors come out."""

from __future__ import annotations

import os
import threading
from collections import Counter
from time import perf_counter

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter import threads
from safefilter.threads import MIN_ITEMS, over_ranges, over_worlds

numbers_of_items = st.one_of(
    st.integers(0, 40),
    st.sampled_from((MIN_ITEMS - 1, MIN_ITEMS, MIN_ITEMS + 1)),
    st.integers(0, 5 * MIN_ITEMS),
)
# More than this machine may have: numba only says how many.
numbers_of_threads = st.integers(1, 9)


class Ranges:
    """Notes which items were worked on, and by which threads.

    Attributes:
        calls: Ranges worked on.
        threads: Names of the threads that worked.
        failing: Items that raise.
        pause: How long each range takes at least, in s; long work is shared out.
    """

    def __init__(self, failing: frozenset[int] = frozenset(), pause: float = 0.0) -> None:
        self.calls: list[tuple[int, int]] = []
        self.threads: set[str] = set()
        self.failing, self.pause = failing, pause
        self.lock = threading.Lock()

    def __call__(self, first: int, last: int) -> None:
        with self.lock:
            self.calls.append((first, last))
            self.threads.add(threading.current_thread().name)
        until = perf_counter() + self.pause
        while perf_counter() < until:
            threading.Event().wait(1e-4)  # as a kernel does: the interpreter lock is let go
        wrong = self.failing.intersection(range(first, last))
        if wrong:
            raise ZeroDivisionError(f"item {min(wrong)}")

    def items(self) -> Counter[int]:
        return Counter(item for first, last in self.calls for item in range(first, last))


def run(work: Ranges, num_items: int, num_threads: int, *, is_worth_it: bool = True) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba, "get_num_threads", lambda: num_threads)
        patch.setattr(threads, "WORTH_SHARING", 0.0 if is_worth_it else 1e9)
        over_ranges(work, num_items)


@given(num_items=numbers_of_items, num_threads=numbers_of_threads, is_worth_it=st.booleans())
def test_every_item_is_worked_on_once(
    num_items: int, num_threads: int, *, is_worth_it: bool
) -> None:
    work = Ranges()
    run(work, num_items, num_threads, is_worth_it=is_worth_it)
    assert work.items() == Counter(range(num_items))


@given(num_items=numbers_of_items, num_threads=numbers_of_threads, is_worth_it=st.booleans())
def test_what_is_given_comes_before_the_range(
    num_items: int, num_threads: int, *, is_worth_it: bool
) -> None:
    work = Ranges()

    def told(one: str, other: int, first: int, last: int) -> None:
        assert (one, other) == ("one", 2)
        work(first, last)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba, "get_num_threads", lambda: num_threads)
        patch.setattr(threads, "WORTH_SHARING", 0.0 if is_worth_it else 1e9)
        over_ranges(told, num_items, "one", 2)
    assert work.items() == Counter(range(num_items))


@given(num_items=st.integers(MIN_ITEMS, 5 * MIN_ITEMS), num_threads=st.integers(2, 9))
def test_large_batches_are_shared_out_in_ranges_that_hold_something(
    num_items: int, num_threads: int
) -> None:
    work = Ranges()
    run(work, num_items, num_threads)
    assert all(first < last for first, last in work.calls)
    assert len(work.calls) > 1


def test_long_work_is_shared_with_others() -> None:
    work = Ranges(pause=2e-3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba, "get_num_threads", lambda: 3)
        over_ranges(work, 10 * MIN_ITEMS)
    assert work.items() == Counter(range(10 * MIN_ITEMS))
    assert threading.current_thread().name in work.threads
    assert any(name.startswith("safefilter") for name in work.threads)


@pytest.mark.parametrize(
    ("num_items", "num_threads"), [(MIN_ITEMS - 1, 8), (10 * MIN_ITEMS, 1), (0, 8)]
)
def test_small_batches_and_single_threads_stay_with_the_caller(
    num_items: int, num_threads: int
) -> None:
    work = Ranges()
    run(work, num_items, num_threads)
    assert work.calls == [(0, num_items)]
    assert work.threads == {threading.current_thread().name}


def test_short_work_stays_with_the_caller_however_many_items_it_has() -> None:
    work = Ranges()
    run(work, 100 * MIN_ITEMS, 8, is_worth_it=False)
    assert work.threads == {threading.current_thread().name}
    assert len(work.calls) == 2


def test_helpers_that_do_not_come_are_not_waited_for() -> None:
    # One helper, and it is kept busy elsewhere: as on a machine whose other cores are.
    free = threading.Event()
    run(Ranges(), 2 * MIN_ITEMS, 2)
    busy = threads._pools[2].submit(free.wait, 60.0)
    try:
        work = Ranges()
        run(work, 4 * MIN_ITEMS, 2)
        assert work.items() == Counter(range(4 * MIN_ITEMS))
        assert work.threads == {threading.current_thread().name}
    finally:
        free.set()
        assert busy.result()


@given(
    num_items=st.integers(MIN_ITEMS, 5 * MIN_ITEMS),
    num_threads=numbers_of_threads,
    place=st.floats(0.0, 1.0, exclude_max=True),
)
def test_an_error_comes_out_after_all_work_has_ended(
    num_items: int, num_threads: int, place: float
) -> None:
    wrong = int(place * num_items)
    work = Ranges(frozenset({wrong}))
    with pytest.raises(ZeroDivisionError, match=rf"^item {wrong}$"):
        run(work, num_items, num_threads)
    # Nobody writes into the caller's arrays afterwards, and nothing was worked on twice.
    calls = len(work.calls)
    assert max(work.items().values()) == 1
    run(Ranges(), num_items, num_threads)
    assert len(work.calls) == calls


def test_a_failure_does_not_spoil_the_next_call() -> None:
    with pytest.raises(ZeroDivisionError):
        run(Ranges(frozenset({0})), 2 * MIN_ITEMS, 3)
    work = Ranges()
    run(work, 2 * MIN_ITEMS, 3)
    assert work.items() == Counter(range(2 * MIN_ITEMS))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_forked_child_makes_threads_of_its_own() -> None:
    run(Ranges(), 2 * MIN_ITEMS, 2)
    child = os.fork()
    if child == 0:
        # Leaves at once: pytest must not go on twice. A child that waited for lost threads would hang.
        work = Ranges()
        run(work, 2 * MIN_ITEMS, 2)
        os._exit(0 if work.items() == Counter(range(2 * MIN_ITEMS)) else 1)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize(("num_worlds", "num_robots"), [(3, 2), (MIN_ITEMS, 1), (50, 7)])
def test_every_world_is_worked_on_once(num_worlds: int, num_robots: int, num_threads: int) -> None:
    count = np.zeros(num_worlds, dtype=np.int64)

    def work(given: str, first: int, last: int) -> None:
        assert given == "given"
        count[first:last] += 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba, "get_num_threads", lambda: num_threads)
        patch.setattr(threads, "WORTH_SHARING", 0.0)
        over_worlds(work, num_worlds, num_robots, "given")
    assert (count == 1).all()

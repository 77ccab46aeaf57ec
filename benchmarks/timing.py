"""Time things against each other: interleaved, warmed up, without the garbage collector.

A ratio of two times of one run says something on any machine; a time says something on this one only.
"""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Callable, Iterator, Mapping
from time import perf_counter

import numba
import numpy as np

from safefilter.arrays import FloatArray

Action = Callable[[], object]


@contextlib.contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Collect now, and not again inside of the block."""
    was_on = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@contextlib.contextmanager
def on_threads(number: int) -> Iterator[None]:
    """Let kernels use this many threads inside of the block; numba refuses more than it has."""
    before = numba.get_num_threads()
    numba.set_num_threads(number)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def interleaved(
    actions: Mapping[str, Action],
    *,
    rounds: int,
    warm_up: int = 2,
    prepare: Mapping[str, Action] | None = None,
) -> dict[str, FloatArray]:
    """Time actions in turn, round after round, so that a busy moment of the machine falls on all of them.

    Args:
        actions: What to time, by name; in every round the order is reversed.
        rounds: How often each is timed.
        warm_up: Rounds before that, which are not counted.
        prepare: What to call before an action of the same name, not timed.

    Returns:
        Times of each action in s, shape (rounds,).
    """
    times = {name: np.empty(rounds) for name in actions}
    preparations = prepare or {}
    with no_garbage_collection():
        for turn in range(-warm_up, rounds):
            order = list(actions.items())
            for name, action in order if turn % 2 else reversed(order):
                if name in preparations:
                    preparations[name]()
                start = perf_counter()
                action()
                elapsed = perf_counter() - start
                if turn >= 0:
                    times[name][turn] = elapsed
    return times

import gc

import numba
import numpy as np
import pytest

from benchmarks.timing import interleaved, no_garbage_collection, on_threads


def test_actions_take_turns_and_only_counted_rounds_are_kept() -> None:
    calls: list[str] = []
    actions = {name: (lambda name=name: calls.append(name)) for name in ("a", "b")}
    times = interleaved(
        actions, rounds=3, warm_up=1, prepare={"b": lambda: calls.append("before b")}
    )
    turns = [call for call in calls if call != "before b"]
    assert sorted(turns[:2]) == sorted(turns[2:4]) == ["a", "b"]
    assert turns[:2] != turns[2:4]
    assert len(turns) == 8
    assert all(calls[k - 1] == "before b" for k, call in enumerate(calls) if call == "b")
    assert {name: taken.shape for name, taken in times.items()} == {"a": (3,), "b": (3,)}
    assert all((taken > 0.0).all() and np.isfinite(taken).all() for taken in times.values())


def test_garbage_collection_is_off_inside_and_on_again_afterwards() -> None:
    with no_garbage_collection():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_threads_are_set_for_a_block_and_put_back() -> None:
    before = numba.get_num_threads()
    with on_threads(1):
        assert numba.get_num_threads() == 1
    most: int = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]  # numba's types know no settings
    with pytest.raises(ValueError, match="number of threads"), on_threads(most + 1):
        pass
    assert numba.get_num_threads() == before

from pathlib import Path

import pytest

from benchmarks.crowd_memory import OURS, RESET, THEIRS, measure_memory, memory_rows


@pytest.mark.skipif(
    not RESET.exists(), reason="only Linux tells how much memory was in use at most"
)
@pytest.mark.parametrize("which", [OURS, THEIRS])
def test_a_step_takes_some_memory(which: str) -> None:
    found = measure_memory(which, 20_000)
    # Positions, velocities and neighbours alone take more, and a robot that takes 10 kB is a leak.
    assert 200.0 < found["at most"] < 10_000.0
    if which == OURS:
        assert found["decision"] >= 8.0 * (2 + 2 + 2)


def test_nothing_is_told_where_the_system_does_not_tell(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("benchmarks.crowd_memory.RESET", tmp_path / "missing")
    assert list(memory_rows(100)) == []

from pathlib import Path

import pytest

from benchmarks.crowd_memory import RESET, memory_rows


@pytest.mark.skipif(
    not RESET.exists(), reason="only Linux tells how much memory was in use at most"
)
def test_a_step_takes_some_memory() -> None:
    theirs, ours = memory_rows(20_000)
    for row in (theirs, ours):
        # Positions, velocities and neighbours alone take more, and a robot that takes 10 kB is a leak.
        assert 200.0 < row.numbers["at most"] < 10_000.0
    assert ours.numbers["decision"] >= 8.0 * (2 + 2 + 2)


def test_nothing_is_told_where_the_system_does_not_tell(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("benchmarks.crowd_memory.RESET", tmp_path / "missing")
    assert list(memory_rows(100)) == []

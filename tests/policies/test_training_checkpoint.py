"""Tests of checkpoints of a training: the newest whole one is what it goes on from."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from policies import training_checkpoint
from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
)
from policies.training_checkpoint import TrainingCheckpoints
from safefilter.errors import InvalidInput, OutOfRange


def state(number: int) -> dict[str, object]:
    return {"curve": [0.0, float("nan"), number], "weights": np.full((50, 3), number)}


@pytest.fixture
def checkpoints(tmp_path: Path) -> TrainingCheckpoints:
    checkpoints = TrainingCheckpoints(tmp_path / "run" / "checkpoints")
    for number in (5, 10, 15):
        checkpoints.write(number, state(number))
    return checkpoints


def newest(checkpoints: TrainingCheckpoints) -> Path:
    return checkpoints.folder / f"training-{checkpoints.numbers()[-1]:012d}.safetensors"


def assert_restores(checkpoints: TrainingCheckpoints, number: int, *torn: str) -> None:
    restored = checkpoints.read()
    assert restored.number == number
    assert restored.state["curve"][2] == number
    assert (restored.state["weights"] == number).all()
    assert len(restored.torn) == len(torn)
    assert all(reason in said for said, reason in zip(restored.torn, torn, strict=True))


def test_the_last_two_are_kept(checkpoints: TrainingCheckpoints) -> None:
    assert checkpoints.numbers() == [10, 15]
    assert len(list(checkpoints.folder.iterdir())) == 2
    assert_restores(checkpoints, 15)


def test_every_cut_falls_back_to_the_one_before(checkpoints: TrainingCheckpoints) -> None:
    whole = newest(checkpoints).read_bytes()
    for length in {*range(0, len(whole), 127), 1, 8, 9, len(whole) - 1}:
        newest(checkpoints).write_bytes(whole[:length])
        assert_restores(checkpoints, 10, "cut")


def test_every_changed_byte_falls_back_to_the_one_before(checkpoints: TrainingCheckpoints) -> None:
    whole = newest(checkpoints).read_bytes()
    for place in {*range(0, len(whole), 67), *range(9), len(whole) - 1}:
        changed = bytearray(whole)
        changed[place] ^= 1 << (place % 8)
        newest(checkpoints).write_bytes(changed)
        assert_restores(checkpoints, 10, "training-000000000015")


def test_zeros_that_a_power_cut_left_fall_back_to_the_one_before(
    checkpoints: TrainingCheckpoints,
) -> None:
    newest(checkpoints).write_bytes(bytes(newest(checkpoints).stat().st_size))
    assert_restores(checkpoints, 10, "no safetensors file")


def test_an_older_one_under_a_newer_name_is_not_taken(checkpoints: TrainingCheckpoints) -> None:
    older = checkpoints.folder / "training-000000000010.safetensors"
    newest(checkpoints).write_bytes(older.read_bytes())
    assert_restores(checkpoints, 10, "not as it was written")


def test_if_both_are_torn_that_is_said(checkpoints: TrainingCheckpoints) -> None:
    for path in checkpoints.folder.iterdir():
        path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(CheckpointAltered, match=r"begin anew: .*0015.*cut.*; .*0010.*cut"):
        checkpoints.read()


def test_after_falling_back_the_abandoned_future_is_removed(
    checkpoints: TrainingCheckpoints,
) -> None:
    newest(checkpoints).write_bytes(b"torn")
    checkpoints.write(12, state(12))
    assert checkpoints.numbers() == [10, 12]
    assert_restores(checkpoints, 12)


def test_a_number_can_be_written_again(checkpoints: TrainingCheckpoints) -> None:
    checkpoints.write(15, {"curve": [0, 0, 15], "weights": np.array(15)})
    assert checkpoints.read().state["weights"].shape == ()


def test_what_killed_writers_left_is_removed_and_nothing_else(
    checkpoints: TrainingCheckpoints,
) -> None:
    (checkpoints.folder / ".training-000000000020.safetensors.1.tmp").write_bytes(b"half")
    (checkpoints.folder / "notes.txt").write_text("mine")
    checkpoints.write(20, state(20))
    assert sorted(path.name for path in checkpoints.folder.iterdir()) == [
        "notes.txt",
        "training-000000000015.safetensors",
        "training-000000000020.safetensors",
    ]


def test_without_a_checkpoint_that_is_said(tmp_path: Path) -> None:
    with pytest.raises(CheckpointMissing, match="there is no checkpoint; begin a training"):
        TrainingCheckpoints(tmp_path / "none").read()


def test_another_version_is_no_torn_file(
    checkpoints: TrainingCheckpoints, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(training_checkpoint, "VERSION", "2")
        checkpoints.write(20, state(20))
    with pytest.raises(CheckpointForeign, match=r"version 1, got .* of version 2; go on with"):
        checkpoints.read()


def test_a_state_that_could_not_be_read_is_not_written(
    checkpoints: TrainingCheckpoints, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_checkpoint, "MAX_BYTES", 100)
    with pytest.raises(CheckpointTooLarge, match="expected at most 100"):
        checkpoints.write(20, state(20))
    with pytest.raises(CheckpointTooLarge, match="expected at most 100"):
        checkpoints.read()


def test_what_cannot_be_kept_leaves_the_others(checkpoints: TrainingCheckpoints) -> None:
    with pytest.raises(InvalidInput, match="cannot be kept"):
        checkpoints.write(20, {"policy": object()})
    assert_restores(checkpoints, 15)


@pytest.mark.parametrize("number", [-1, 10**12])
def test_numbers_have_a_range(tmp_path: Path, number: int) -> None:
    with pytest.raises(OutOfRange, match="expected 0 to 999"):
        TrainingCheckpoints(tmp_path).write(number, {})


WRITER = """
import sys
from pathlib import Path
import numpy as np
from policies.training_checkpoint import TrainingCheckpoints
checkpoints = TrainingCheckpoints(Path(sys.argv[1]))
for number in range(10**6):
    checkpoints.write(number, {"curve": [0, 0, number], "weights": np.full(200_000, number)})
    print(number, flush=True)
"""


@pytest.mark.stress
def test_a_writer_killed_at_any_time_leaves_a_whole_checkpoint(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for trial in range(8):
        checkpoints = TrainingCheckpoints(tmp_path / str(trial))
        command = [sys.executable, "-c", WRITER, str(checkpoints.folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "0\n"
            time.sleep(rng.uniform(0.0, 0.05))
            writer.send_signal(signal.SIGKILL)
            told = [0, *map(int, writer.stdout.read().split())]
        restored = checkpoints.read()
        assert restored.number >= told[-1], "what was told to be written is there"
        assert (restored.state["weights"] == restored.number).all()
        assert restored.torn == ()

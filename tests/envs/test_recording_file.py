import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import Crossroad, Fleet, Navigation
from envs.recording import Moment, Recording, Setting
from envs.recording_file import RecordingCut, RecordingFileError, RecordingWriter, read_recording
from envs.world import World


def written(path: Path, num_steps: int = 6, *, is_whole: bool = True) -> Recording:
    """A file of an episode, and the same one in memory."""
    fleet = Fleet.of(8, priority=[1.0, 4.0] * 4, kinematics="differential")
    navigation = Navigation(Crossroad(is_walled=True), fleet)
    navigation.reset(3)
    world, rng = navigation.world, np.random.default_rng(0)
    setting = Setting.of(world, 0, 0.2, "crossroad", 3)
    moments = [Moment.of(world, 0)]
    writer = RecordingWriter(path, setting)
    writer.write(moments[0])
    for _ in range(num_steps):
        action = rng.uniform(0.0, 0.2, (1, 8, 2))
        navigation.step(action)
        moments.append(Moment.of(world, 0, action[0], rng.integers(0, 4, 8)))
        writer.write(moments[-1])
    writer.close(is_whole=is_whole)
    return Recording.of(setting, moments)


def assert_same(found: Recording, expected: Recording) -> None:
    for one, other in ((found, expected), (found.setting, expected.setting)):
        for field in fields(one):
            value = getattr(other, field.name)
            if isinstance(value, np.ndarray):
                assert getattr(one, field.name).dtype == value.dtype, field.name
                assert getattr(one, field.name).tobytes() == value.tobytes(), field.name
            elif field.name != "setting":
                assert getattr(one, field.name) == value, field.name


def test_what_is_read_is_what_was_written_bit_for_bit(tmp_path: Path) -> None:
    expected = written(tmp_path / "a.jsonl")
    assert_same(read_recording(tmp_path / "a.jsonl"), expected)


def test_every_line_is_json_of_its_own_and_the_first_says_what_it_is(tmp_path: Path) -> None:
    written(tmp_path / "a.jsonl", num_steps=2)
    first, *moments, last = map(json.loads, (tmp_path / "a.jsonl").read_text().splitlines())
    assert (first["format"], first["version"]) == ("safefilter recording", 1)
    assert (first["scenario"], first["seed"], first["dt"]) == ("crossroad", 3, 0.2)
    assert [moment["step"] for moment in moments] == [0, 1, 2]
    assert last["end"]


def test_actions_of_a_recording_repeat_its_episode_bit_for_bit(tmp_path: Path) -> None:
    written(tmp_path / "a.jsonl")
    recording = read_recording(tmp_path / "a.jsonl")
    fleet = Fleet.of(8, priority=recording.setting.priority, kinematics="differential")
    navigation = Navigation(Crossroad(is_walled=True), fleet)
    navigation.reset(recording.setting.seed)
    for moment in range(1, recording.num_moments):
        navigation.step(recording.action[moment : moment + 1])
        assert navigation.world.position[0].tobytes() == recording.position[moment].tobytes()


@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_a_file_cut_anywhere_is_read_up_to_its_last_whole_moment(
    share: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.jsonl"
    whole = written(path)
    content = path.read_bytes()
    cut = content[: int(share * len(content))]
    path.write_bytes(cut)
    num_moments = max(0, cut.count(b"\n") - 1)
    with pytest.raises(RecordingCut, match="cut"):
        read_recording(path)
    if num_moments:
        found = read_recording(path, may_be_cut=True)
        assert found.num_moments == num_moments
        np.testing.assert_array_equal(found.position, whole.position[:num_moments])
    else:
        with pytest.raises(RecordingCut):
            read_recording(path, may_be_cut=True)


@given(place=st.integers(0, 10**6), byte=st.sampled_from(b"0123456789.,[]{}x"))
def test_a_changed_byte_is_noticed(
    place: int, byte: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("changed") / "a.jsonl"
    written(path, num_steps=2)
    content = bytearray(path.read_bytes())
    place %= len(content) - 1
    if content[place] in {byte, ord("\n")}:
        return
    content[place] = byte
    path.write_bytes(content)
    with pytest.raises(
        RecordingFileError,
        match=r"a\.jsonl:\d+: (changed, or moved: the checksum differs|no recording)",
    ):
        read_recording(path, may_be_cut=True)


def test_lost_and_swapped_lines_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    written(path)
    lines = path.read_text().splitlines(keepends=True)
    for changed in (lines[:3] + lines[4:], [*lines[:3], lines[4], lines[3], *lines[5:]]):
        path.write_text("".join(changed))
        with pytest.raises(RecordingFileError, match=":4: changed, or moved"):
            read_recording(path, may_be_cut=True)
    path.write_text("".join([*lines, lines[-1]]))
    with pytest.raises(RecordingFileError, match="checksum differs"):
        read_recording(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "cut within its first line"),
        (b"name: crossroad\n", ":1: no recording of this package"),
        (b"PK", ":1: no recording of this package"),
        (b'{"format":"other"}\n', ":1: no recording of this package"),
        (b"\xff\xfe\x00\n", "cannot be read"),
    ],
)
def test_foreign_files_are_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_bytes(content)
    with pytest.raises(RecordingFileError, match=message):
        read_recording(path)
    with pytest.raises(RecordingFileError, match="cannot be read"):
        read_recording(tmp_path / "none.jsonl")


def test_other_versions_and_other_fields_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.jsonl"
    monkeypatch.setattr("envs.recording_file.VERSION", 2)
    written(path)
    monkeypatch.undo()
    with pytest.raises(RecordingFileError, match=":1: expected version 1, got 2; read it with"):
        read_recording(path)
    recording = written(path)
    with RecordingWriter(path, recording.setting) as writer:
        writer._write({"step": 0, "position": [[0, 0]]})
    with pytest.raises(RecordingFileError, match=r":2: position: expected shape \(8, 2\)"):
        read_recording(path)
    with RecordingWriter(path, replace(recording.setting, dt=0.0)) as writer:
        writer.write(Moment.of(World.empty(1, Fleet.of(8)), 0))
    with pytest.raises(RecordingFileError, match=":1: dt: "):
        read_recording(path)
    with RecordingWriter(path, recording.setting) as writer:
        writer._write({"step": 0})
    with pytest.raises(RecordingFileError, match=":2: 'position' is missing"):
        read_recording(path)


def test_what_a_program_wrote_before_it_failed_is_there(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    recording = written(path)
    moment = Moment(
        0,
        *(
            getattr(recording, field.name)[0].copy()
            for field in fields(Moment)
            if field.name != "step"
        ),
    )

    def fail() -> None:
        with RecordingWriter(path, recording.setting) as writer:
            writer.write(moment)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    with pytest.raises(RecordingCut, match=r"cut after 1 moments.*pass may_be_cut=True"):
        read_recording(path)
    assert read_recording(path, may_be_cut=True).num_moments == 1

"""Files are data: damaged and made-up ones are refused by an error that names them, soon, and nothing runs."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from envs import Crossroad, Fleet, Navigation, recording_file
from envs.recording import Moment, Setting
from envs.recording_file import RecordingFileError, RecordingWriter, read_recording
from envs.scenarios import load_scenario, yaml_lines
from envs.scenarios.library import LIBRARY, scenario_names
from safefilter.errors import SafeFilterError

PATIENCE = 5.0
# One folder a test, whose file every example writes anew.
SAME_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])

values = st.recursive(
    st.sampled_from((None, True, 0, -1, 2**70, 10**400, 0.5, 1e308, "", "x", "nan"))
    | st.integers(-3, 3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.just("x"), inner, max_size=1),
    max_leaves=6,
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("recording") / "whole.jsonl"
    navigation = Navigation(Crossroad(is_walled=True), Fleet.of(8))
    navigation.reset(3)
    with RecordingWriter(path, Setting.of(navigation.world, 0, 0.2, "crossroad", 3)) as writer:
        writer.write(Moment.of(navigation.world, 0))
        for _ in range(2):
            action = np.full((1, 8, 2), 0.1)
            navigation.step(action)
            writer.write(Moment.of(navigation.world, 0, action[0], np.ones(8, dtype=np.int64)))
    read_recording(path)
    return path.read_bytes()


def read_or_refuse(path: Path, content: bytes) -> bool:
    """Was it read? Anything but an error of ours fails the test."""
    path.write_bytes(content)
    start, complaint = process_time(), ""
    try:
        read_recording(path, may_be_cut=True)
    except SafeFilterError as error:
        complaint = str(error)
    assert process_time() - start <= PATIENCE
    assert path.name in complaint or not complaint
    return not complaint


def damaged(data: st.DataObject, content: bytes) -> bytes:
    place = data.draw(st.integers(0, len(content) - 1))
    piece = data.draw(st.binary(min_size=1, max_size=4))
    return data.draw(
        st.sampled_from((
            content[:place],
            content[:place] + piece + content[place + len(piece) :],
            content[:place] + piece + content[place:],
            content[:place] + content[place + 1 :],
            content + content,
            piece + content,
        ))
    )


@SAME_FOLDER
@given(data=st.data())
def test_a_damaged_recording_is_refused_or_read_up_to_the_damage(
    data: st.DataObject, recording: bytes, tmp_path: Path
) -> None:
    content = damaged(data, recording)
    if read_or_refuse(tmp_path / "damaged.jsonl", content):
        # The damage hurts no line that was read: it is a cut.
        assert recording.startswith(content[: content.rfind(b"\n") + 1])


def with_checksums(records: list[Any]) -> bytes:
    """A file whose checksums are right, whatever its records are."""
    checksum, lines = 0, []
    for record in records:
        body = json.dumps(record, separators=(",", ":"))
        checksum = zlib.crc32(body.encode(), checksum)
        lines.append(f'{body[:-1]},"crc32":"{checksum:08x}"}}\n')
    return "".join(lines).encode()


@SAME_FOLDER
@given(data=st.data())
def test_a_made_up_recording_with_right_checksums_is_refused_or_read(
    data: st.DataObject, recording: bytes, tmp_path: Path
) -> None:
    records = []
    for line in recording.splitlines():
        record = json.loads(line)
        del record["crc32"]
        records.append(record)
    number = data.draw(st.integers(0, len(records) - 1))
    field = data.draw(st.sampled_from(sorted(records[number])))
    records[number][field] = data.draw(values)
    read_or_refuse(tmp_path / "made_up.jsonl", with_checksums(records))


@pytest.mark.parametrize(
    "content",
    [b"", b"\n", b"\xff\xfe", b"{}\n", b"[" * 100_000, b"\x00" * 100],
    ids=["empty", "newline", "not utf-8", "no checksum", "deep", "zeros"],
)
def test_what_is_no_recording_is_refused(content: bytes, tmp_path: Path) -> None:
    assert not read_or_refuse(tmp_path / "other.jsonl", content)


def test_a_recording_that_nests_without_end_is_refused(recording: bytes, tmp_path: Path) -> None:
    first = recording.splitlines(keepends=True)[0].decode()
    body = '{"step":' + "[" * 100_000 + "]" * 100_000 + "}"
    checksum = zlib.crc32(first[: first.rindex(',"crc32"')].encode() + b"}")
    checksum = zlib.crc32(body.encode(), checksum)
    line = f'{body[:-1]},"crc32":"{checksum:08x}"}}\n'
    assert not read_or_refuse(tmp_path / "deep.jsonl", (first + line).encode())


def test_a_recording_that_is_too_large_is_refused_unread(
    recording: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording_file, "MAX_BYTES", len(recording) - 1)
    path = tmp_path / "large.jsonl"
    path.write_bytes(recording)
    with pytest.raises(RecordingFileError, match=f"at most {len(recording) - 1} bytes, got"):
        read_recording(path)


def load_or_refuse(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    start, complaint = process_time(), path.name
    try:
        load_scenario(path)
    except SafeFilterError as error:
        complaint = str(error)
    assert process_time() - start <= PATIENCE
    assert path.name in complaint


LAYOUT = (LIBRARY / f"{scenario_names()[0]}.yaml").read_bytes()


@SAME_FOLDER
@given(data=st.data())
def test_a_damaged_layout_is_refused_or_read(data: st.DataObject, tmp_path: Path) -> None:
    load_or_refuse(tmp_path / "damaged.yaml", damaged(data, LAYOUT))


@SAME_FOLDER
@given(st.text(alphabet=st.sampled_from("abe:-[]{}&*!|>#'\"?,0.19 \n\t"), max_size=40))
def test_text_is_refused_or_read(tmp_path: Path, text: str) -> None:
    load_or_refuse(tmp_path / "text.yaml", text.encode())


# Nine to the power of nine copies, if each alias were written out.
LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(9)
)


@pytest.mark.parametrize(
    "text",
    [
        LAUGHS,
        "&a [*a]",
        "[" * 5000,
        "!!python/object/apply:os.system ['touch stolen']",
        "!!timestamp never",
        "a: 2020-99-99",
        f"a: {'9' * 5000}",
        "a: \0",
    ],
    ids=["laughs", "itself", "deep", "code", "tag", "date", "digits", "zero"],
)
def test_a_hostile_layout_is_refused_soon_and_runs_nothing(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    load_or_refuse(tmp_path / "hostile.yaml", text.encode())
    assert not (tmp_path / "stolen").exists()


def test_a_layout_that_is_too_large_is_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(yaml_lines, "MAX_BYTES", len(LAYOUT) - 1)
    path = tmp_path / "large.yaml"
    path.write_bytes(LAYOUT)
    with pytest.raises(SafeFilterError, match=f"at most {len(LAYOUT) - 1} bytes, got"):
        load_scenario(path)

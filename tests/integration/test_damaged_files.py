"""Whatever becomes of a file, or is in its place: it is read as it was written, or refused by an error that names it.

Nothing runs, nothing is written, nothing takes long or much memory; where a checksum is part of the file nothing that
was changed is read.
"""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path
from time import process_time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from assurance.file_damage import FOREIGN, damages, flips, strange_trees, truncations
from assurance.file_loaders import FILE_LOADERS, FileLoader
from assurance.file_trees import FILE_TREES, STRANGE_ARRAYS, tensor_parts, weights_file
from policies.checkpoint import read_weights
from policies.tensor_file import TensorFile
from safefilter.errors import SafeFilterError

PATIENCE = 5.0
# A file of some kB is read: more than this is memory that it only announces.
MOST_MEMORY = 64 * 2**20
SAME_FOLDER = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)

LIMITS = (
    "envs.recording_file.MAX_BYTES", "envs.scenarios.yaml_lines.MAX_BYTES", "policies.checkpoint.MAX_BYTES",
    "policies.checkpoint.MAX_CARD_BYTES", "policies.curves.MAX_CURVE_BYTES", "policies.foreign_policy.MAX_ONNX_BYTES",
    "policies.onnx_policy.MAX_BYTES", "policies.ship.MAX_ROWS_BYTES", "policies.table_cell.MAX_BYTES",
    "policies.training_checkpoint.MAX_BYTES", "safefilter.comparison.problem_file.MAX_BYTES",
)  # fmt: skip

Written = tuple[FileLoader, Path, bytes, str]


@pytest.fixture(params=FILE_LOADERS, ids=lambda loader: loader.name)
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Written:
    """A usable file: its loader, folder, content, and what is read from it."""
    loader: FileLoader = request.param
    loader.write(tmp_path)
    return loader, tmp_path, (tmp_path / loader.file).read_bytes(), loader.load(tmp_path)


def files_in(folder: Path) -> dict[str, tuple[int, int]]:
    found = (path for path in folder.rglob("*") if not path.is_dir())
    return {str(path): (path.lstat().st_mtime_ns, path.lstat().st_size) for path in found}


def read_or_refuse(loader: FileLoader, folder: Path) -> str | None:
    """What was read; None if it was refused. Anything but an error of ours that names the file fails."""
    before, start, complaint = files_in(folder), process_time(), ""
    read: str | None = None
    try:
        read = loader.load(folder)
    except SafeFilterError as error:
        complaint = str(error)
    # Of a folder without any such file the folder is named.
    is_there = (folder / loader.file).is_file()
    assert read is not None or (Path(loader.file).name if is_there else folder.name) in complaint
    assert process_time() - start <= PATIENCE
    assert files_in(folder) == before
    return read


def try_content(written: Written, content: bytes) -> None:
    loader, folder, whole, usual = written
    (folder / loader.file).write_bytes(content)
    read = read_or_refuse(loader, folder)
    if loader.is_sealed and content != whole:
        assert read in {None, usual}


def test_a_file_is_refused_wherever_it_is_cut_or_a_bit_is_another(written: Written) -> None:
    for content in (*truncations(written[2], 40), *flips(written[2], 40)):
        try_content(written, content)


@SAME_FOLDER
@given(data=st.data())
def test_a_file_is_refused_or_read_whatever_bytes_are_lost_or_put_in(
    written: Written, data: st.DataObject
) -> None:
    try_content(written, data.draw(damages(written[2])))


@pytest.mark.parametrize("content", FOREIGN.values(), ids=FOREIGN)
def test_another_file_in_its_place_is_refused(
    written: Written, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = written[1]
    monkeypatch.chdir(folder)
    tracemalloc.start()
    try:
        try_content(written, content)
        assert tracemalloc.get_traced_memory()[1] <= MOST_MEMORY
    finally:
        tracemalloc.stop()
    assert not (folder / "stolen").exists()


def test_what_is_no_file_is_refused_unopened(written: Written) -> None:
    loader, folder, *_ = written
    path = folder / loader.file
    path.unlink()
    os.mkfifo(path)
    read_or_refuse(loader, folder)
    path.unlink()
    path.mkdir()
    read_or_refuse(loader, folder)
    path.rmdir()
    path.symlink_to("/dev/zero")
    read_or_refuse(loader, folder)


def test_a_file_that_is_too_large_is_refused(
    written: Written, monkeypatch: pytest.MonkeyPatch
) -> None:
    loader, folder, content, _ = written
    (folder / loader.file).write_bytes(content + bytes(301))
    for limit in LIMITS:
        monkeypatch.setattr(limit, 300)
    with pytest.raises(SafeFilterError, match="at most 300 bytes, got"):
        loader.load(folder)


@pytest.mark.parametrize("loader", FILE_LOADERS, ids=lambda loader: loader.name)
@SAME_FOLDER
@given(data=st.data())
def test_strange_content_behind_a_right_checksum_is_refused_or_read(
    loader: FileLoader, data: st.DataObject, tmp_path: Path
) -> None:
    if loader.name not in FILE_TREES:
        return
    path = tmp_path / loader.file
    if not path.exists():
        loader.write(tmp_path)
        path.with_suffix(".whole").write_bytes(path.read_bytes())
    whole = path.with_suffix(".whole").read_bytes()
    tree = FILE_TREES[loader.name]
    path.write_bytes(tree.made(whole, data.draw(strange_trees(tree.taken(whole)))))
    read_or_refuse(loader, tmp_path)


def test_files_that_are_made_again_unchanged_are_read(tmp_path: Path) -> None:
    for loader in FILE_LOADERS:
        if loader.name in FILE_TREES:
            folder = tmp_path / loader.name
            folder.mkdir()
            loader.write(folder)
            usual, path = loader.load(folder), folder / loader.file
            tree, whole = FILE_TREES[loader.name], path.read_bytes()
            path.write_bytes(tree.made(whole, tree.taken(whole)))
            assert loader.load(folder) == usual


@pytest.mark.parametrize("array", STRANGE_ARRAYS, ids=lambda array: f"{array.dtype}{array.shape}")
@pytest.mark.parametrize("name", ["actor.0.weight", "actor.0.bias", "actor.2.weight", "log_std"])
def test_tensors_of_no_network_are_refused(
    name: str, array: np.typing.NDArray[np.generic], tmp_path: Path
) -> None:
    loader = FILE_LOADERS[0]
    loader.write(tmp_path)
    path = tmp_path / loader.file
    file = tensor_parts(path.read_bytes())
    said = FILE_TREES["weights"].taken(path.read_bytes())
    altered = TensorFile({**file.arrays, name: array}, file.texts)
    path.with_suffix(".json").unlink()
    path.write_bytes(weights_file(altered, said))
    with pytest.raises(SafeFilterError, match=f"{loader.file}: "):
        read_weights(path)

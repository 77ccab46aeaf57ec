"""Tests of weights as files: they come back as they were, or not at all."""

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import safetensors.numpy
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import nn

from envs.observation_layout import ObservationLayout
from policies import checkpoint
from policies.card import Card
from policies.checkpoint import read_weights, write_weights
from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointError,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
    CheckpointTruncated,
    TensorError,
)
from policies.policy_weights import Weights
from safefilter.errors import InvalidInput

LAYOUT = ObservationLayout(num_neighbours=1, num_beams=4, has_memory=True)
CARD = Card(
    name="SRL-ORCA",
    data="towns",
    command="python -m policies.train",
    seed=3,
    settings={"ppo": {"clip": 0.2}},
    figures=[{"scenario": "passing", "success_rate": 1.0, "mean_time": None}],
    limits=["not for people"],
)


def make(seed: int = 0, layout: ObservationLayout = LAYOUT, card: Card = CARD) -> Weights:
    rng = np.random.default_rng(seed)
    shapes = {
        "actor.0.weight": (5, layout.size),
        "actor.0.bias": (5,),
        "actor.2.weight": (2, 5),
        "actor.2.bias": (2,),
        "log_std": (2,),
        "critic.0.weight": (1, layout.size),
    }
    arrays = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    return Weights(arrays, layout, card)


def assert_same(one: Weights, other: Weights) -> None:
    assert one.layout == other.layout
    assert one.card == other.card
    assert one.arrays.keys() == other.arrays.keys()
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, other.arrays[name], strict=True)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "policy.safetensors"
    write_weights(path, make())
    return path


def edit_metadata(path: Path, edit: Callable[[dict[str, str]], None]) -> None:
    with safetensors.safe_open(path, "np") as file:
        metadata = file.metadata()
    arrays = safetensors.numpy.load_file(path)
    edit(metadata)
    safetensors.numpy.save_file(arrays, path, metadata)


def test_weights_come_back_bit_for_bit(path: Path) -> None:
    assert_same(read_weights(path), make())


def test_the_card_beside_is_json_for_people(path: Path) -> None:
    said = json.loads(path.with_suffix(".json").read_text())
    assert said["card"]["seed"] == 3
    assert said["tensors"]["actor.0.weight"] == [5, LAYOUT.size]
    assert said["observation"]["num_beams"] == 4
    assert said["observation"]["blocks"][0]["fields"][1] == "min(d, 1 m)"


def test_only_the_pair_is_left(path: Path) -> None:
    assert sorted(file.name for file in path.parent.iterdir()) == [
        "policy.json",
        "policy.safetensors",
    ]


def test_the_file_alone_is_enough(path: Path) -> None:
    path.with_suffix(".json").unlink()
    assert_same(read_weights(path), make())


class Killed(BaseException):
    """Stands for a power cut."""


def kill_after(renames: int, monkeypatch: pytest.MonkeyPatch) -> None:
    left = renames

    def rename(self: Path, target: Path) -> Path:
        nonlocal left
        left -= 1
        if left < 0:
            raise Killed
        return original(self, target)

    original = Path.replace
    monkeypatch.setattr(Path, "replace", rename)


@pytest.mark.parametrize("renames", [0, 1])
def test_a_writer_killed_at_any_point_leaves_the_old_pair_or_the_new_one(
    path: Path, renames: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    kill_after(renames, monkeypatch)
    with pytest.raises(Killed):
        write_weights(path, make(1))
    assert_same(read_weights(path), make(renames))


def test_a_writer_killed_twice_between_the_files_leaves_the_newest(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed in (1, 2):
        with monkeypatch.context() as patch:
            kill_after(1, patch)
            with pytest.raises(Killed):
                write_weights(path, make(seed))
        assert_same(read_weights(path), make(seed))
    write_weights(path, make(3))
    assert_same(read_weights(path), make(3))
    said = json.loads(path.with_suffix(".json").read_text())
    with safetensors.safe_open(path, "np") as file:
        assert json.loads(file.metadata()["card"]) == said


def test_a_card_of_other_weights_is_refused(path: Path) -> None:
    other = path.with_name("other.safetensors")
    write_weights(other, make(1))
    path.with_suffix(".json").write_bytes(other.with_suffix(".json").read_bytes())
    with pytest.raises(
        CheckpointAltered, match=r"not the card of policy\.safetensors; .*delete it"
    ):
        read_weights(path)


def test_a_flattering_card_is_refused(path: Path) -> None:
    beside = path.with_suffix(".json")
    beside.write_text(beside.read_text().replace('"success_rate": 1.0', '"success_rate": 0.5'))
    with pytest.raises(CheckpointAltered, match="not the card of"):
        read_weights(path)


def test_there_is_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(CheckpointMissing, match="there is no such file"):
        read_weights(tmp_path / "none.safetensors")


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "folder.safetensors").mkdir()
    with pytest.raises(CheckpointError, match="expected a file, not a folder"):
        read_weights(tmp_path / "folder.safetensors")


def test_a_name_without_the_suffix_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"ends with \.safetensors"):
        write_weights(tmp_path / "policy.pt", make())


def test_every_cut_is_noticed(path: Path) -> None:
    whole = path.read_bytes()
    for length in {*range(0, len(whole), 97), 1, 7, 8, 9, len(whole) - 1}:
        path.write_bytes(whole[:length])
        with pytest.raises(CheckpointTruncated, match="cut"):
            read_weights(path)


def test_every_changed_byte_is_noticed(path: Path) -> None:
    whole = path.read_bytes()
    header = 8 + int.from_bytes(whole[:8], "little")
    # Each byte of the header, because its texts come in another order in every file.
    for place in {*range(header), *range(header, len(whole), 61), len(whole) - 1}:
        changed = bytearray(whole)
        changed[place] ^= 1 << (place % 8)
        path.write_bytes(changed)
        # What a file replaced is the one thing that it says without a checksum; it is empty here.
        with pytest.raises(CheckpointError):
            read_weights(path)


@pytest.mark.parametrize("name", ["format", "card", "replaces"])
def test_a_text_by_another_name_is_noticed(path: Path, name: str) -> None:
    edit_metadata(path, lambda texts: texts.update({name.upper(): texts.pop(name)}))
    with pytest.raises(CheckpointForeign, match="not weights of this package"):
        read_weights(path)


def test_changed_tensors_are_called_altered(path: Path) -> None:
    changed = bytearray(path.read_bytes())
    changed[-1] ^= 1
    path.write_bytes(changed)
    with pytest.raises(CheckpointAltered, match="changed after they were written"):
        read_weights(path)


def test_a_changed_card_inside_is_called_altered(path: Path) -> None:
    def edit(metadata: dict[str, str]) -> None:
        metadata["card"] = metadata["card"].replace('"seed": 3', '"seed": 4')

    edit_metadata(path, edit)
    with pytest.raises(CheckpointAltered, match="changed after they were written"):
        read_weights(path)


@given(st.binary(max_size=200))
def test_rubbish_is_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("rubbish") / "rubbish.safetensors"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match=r"rubbish\.safetensors"):
        read_weights(path)


@pytest.mark.parametrize(
    "header",
    [
        b"[]",
        b"{",
        b'{"a": 1}',
        b'{"a": {"data_offsets": []}}',
        b'{"__metadata__": {"format": 1}}',
        b"{" + b'"a":{' * 5000,
    ],
)
def test_broken_headers_are_refused(tmp_path: Path, header: bytes) -> None:
    path = tmp_path / "broken.safetensors"
    path.write_bytes(len(header).to_bytes(8, "little") + header)
    with pytest.raises(CheckpointForeign, match=r"broken\.safetensors"):
        read_weights(path)


@pytest.mark.parametrize(
    ("kind", "message"),
    [("F99", "unknown variant"), ("BF16", "numpy has no numbers of type 'BF16'")],
)
def test_numbers_of_other_types_are_refused(tmp_path: Path, kind: str, message: str) -> None:
    header = f'{{"a": {{"dtype": "{kind}", "shape": [0], "data_offsets": [0, 0]}}}}'.encode()
    path = tmp_path / "other.safetensors"
    path.write_bytes(len(header).to_bytes(8, "little") + header)
    with pytest.raises(CheckpointAltered, match=message):
        read_weights(path)


def test_pickles_are_not_executed(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[Callable[[Path], None], tuple[Path]]:
            return Path.touch, (tmp_path / "exploded",)

    path = tmp_path / "bomb.safetensors"
    path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(CheckpointForeign, match=r"pickles .* are not read"):
        read_weights(path)
    assert not (tmp_path / "exploded").exists()


def test_tensors_of_others_are_foreign(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    safetensors.numpy.save_file({"a": np.zeros(3)}, path)
    with pytest.raises(CheckpointForeign, match="not weights of this package; write them with"):
        read_weights(path)


def test_large_files_are_refused_unread(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoint, "MAX_BYTES", 100)
    with pytest.raises(CheckpointTooLarge, match="at most 100 bytes, got"):
        read_weights(path)
    with pytest.raises(CheckpointTooLarge, match="leave settings or figures out"):
        write_weights(path, make())


def rewrite(path: Path, arrays: dict[str, npt.NDArray[np.generic]], **said: object) -> None:
    """A file with a right checksum, but made by somebody else."""
    with safetensors.safe_open(path, "np") as file:
        metadata = file.metadata()
    described = json.loads(metadata["card"]) | said
    described["sha256"] = checkpoint._checksum(arrays, described)  # a forger knows it
    path.with_suffix(".json").unlink()
    safetensors.numpy.save_file(arrays, path, metadata | {"card": json.dumps(described)})


def test_other_types_shapes_and_numbers_are_named(tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    good = {**make().arrays}
    faults: dict[str, dict[str, npt.NDArray[np.generic]]] = {
        r"log_std: expected float32, got float64": {"log_std": np.zeros(2)},
        r"log_std: expected shape \(2,\), got \(3,\)": {"log_std": np.zeros(3, np.float32)},
        r"expected shape \(5, 35\), got \(5, 34\)": {
            "actor.0.weight": np.zeros((5, 34), np.float32)
        },
        r"log_std: 1 of its 2 numbers are NaN": {"log_std": np.array([0, np.nan], np.float32)},
        r"linear layers with ReLUs between; got": {"actor.1.weight": np.zeros(5, np.float32)},
    }
    for message, fault in faults.items():
        write_weights(path, make())
        rewrite(path, {**good, **fault})
        with pytest.raises(TensorError, match=r"policy\.safetensors: .*" + message):
            read_weights(path)


def test_other_versions_and_observations_are_named(tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    good = dict(make().arrays)
    observation = json.loads(json.dumps(checkpoint._observation(LAYOUT)))  # to edit it
    observation["blocks"][0]["fields"][0] = "distance to the goal, as 1 / d"
    faults: dict[str, dict[str, object]] = {
        "expected version 1, got 2": {"version": 2},
        "no layout of observations": {"observation": {"num_wheels": 3}},
        "numbers mean something else": {"observation": observation},
        "expected a card with": {"card": {"name": "x"}},
    }
    for message, fault in faults.items():
        write_weights(path, make())
        rewrite(path, {**good}, **fault)
        with pytest.raises(CheckpointForeign, match=r"policy\.safetensors: .*" + message):
            read_weights(path)


def test_the_tensors_of_torch_fit(tmp_path: Path) -> None:
    first = nn.Linear(LAYOUT.size, 8)
    actor = nn.Sequential(first, nn.ReLU(), nn.Linear(8, 2))
    networks = nn.ModuleDict({"actor": actor})
    arrays = {name: tensor.numpy() for name, tensor in networks.state_dict().items()}
    path = tmp_path / "policy.safetensors"
    write_weights(path, Weights({**arrays, "log_std": np.zeros(2, np.float32)}, LAYOUT, CARD))
    read = dict(read_weights(path).arrays)
    read.pop("log_std")
    nn.init.zeros_(first.weight)
    networks.load_state_dict({name: torch.tensor(array) for name, array in read.items()})
    assert first.weight.any()

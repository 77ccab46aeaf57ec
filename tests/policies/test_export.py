"""Tests of exported policies: they do what the weights do, and say what they are given."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from onnx.reference import ReferenceEvaluator
from rich.console import Console

from envs import Crossroad, Fleet, Navigation
from envs.observation_layout import OWN_FIELDS, ObservationLayout
from policies import export as export_module
from policies.card import Card
from policies.checkpoint import write_weights
from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
    TensorError,
)
from policies.contract import contract, layout_of_contract
from policies.export import ExportDiffers, Format, Settings, export, greatest_difference, main
from policies.foreign_policy import load_foreign
from policies.learned_policy import LearnedPolicy
from policies.onnx_export import to_onnx
from policies.onnx_policy import OnnxPolicy
from policies.onnx_seal import BLANK, sealed
from policies.policy_weights import Weights
from policies.torchscript_export import to_torchscript
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, ShapeError

LAYOUT = ObservationLayout(num_neighbours=3, num_beams=12, has_memory=True)


def make(*hidden: int, scale: float = 0.2, layout: ObservationLayout = LAYOUT) -> Weights:
    rng = np.random.default_rng(0)
    widths = [layout.size, *hidden, 2]
    arrays = {"log_std": np.zeros(2, np.float32)}
    for number in range(len(widths) - 1):
        fan_in, fan_out = widths[number : number + 2]
        weight = scale * rng.normal(size=(fan_out, fan_in))
        arrays[f"actor.{2 * number}.weight"] = weight.astype(np.float32)
        arrays[f"actor.{2 * number}.bias"] = rng.normal(size=fan_out).astype(np.float32)
    return Weights(arrays, layout, Card(name="learned"))


def written(folder: Path, weights: Weights | None = None) -> Path:
    path = folder / "policy.onnx"
    path.write_bytes(to_onnx(make(32, 32) if weights is None else weights))
    return path


def navigation(layout: ObservationLayout = LAYOUT) -> Navigation:
    fleet = Fleet.of(8, kinematics="differential", v_max=np.linspace(0.1, 0.3, 8))
    made = Navigation(Crossroad(), fleet, num_worlds=2, layout=layout)
    made.reset(0)
    return made


RNG = np.random.default_rng(0)


@pytest.mark.parametrize("kind", ["onnx", "torchscript"])
@pytest.mark.parametrize("hidden", [(), (16,), (128, 128)])
def test_what_is_exported_does_what_the_weights_do(
    tmp_path: Path, kind: Format, hidden: tuple[int, ...]
) -> None:
    # As strong as trained ones: raw actions of about 1.
    weights = make(*hidden, scale=0.1)
    assert export(weights, tmp_path / "policy", kind) <= 1e-6


def test_an_independent_evaluation_of_the_graph_agrees() -> None:
    weights = make(16)
    evaluator = ReferenceEvaluator(onnx.load_from_string(to_onnx(weights)))

    def commands(observation: object, v_max: FloatArray, omega_max: FloatArray) -> FloatArray:
        inputs = {
            "observation": observation,
            "v_max": v_max.astype(np.float32),
            "omega_max": omega_max.astype(np.float32),
        }
        return np.asarray(next(iter(evaluator.run(None, inputs))), dtype=np.float64)

    assert greatest_difference(weights, commands) <= 1e-6


def test_an_onnx_policy_drives_as_the_learned_one(tmp_path: Path) -> None:
    weights, worlds = make(32, 32), navigation()
    worlds.world.arrived[0, 1] = True
    policy = OnnxPolicy.of(written(tmp_path), worlds)
    assert (policy.name, policy.layout) == ("policy", LAYOUT)
    expected = LearnedPolicy.of(weights, worlds).act(worlds.world, RNG)
    np.testing.assert_allclose(policy.act(worlds.world, RNG), expected, atol=1e-6)
    assert not expected[0, 1].any()
    assert np.ptp(expected[..., 1]) > 0.1


def test_an_exported_policy_can_be_evaluated_by_its_path(tmp_path: Path) -> None:
    weights, worlds = make(32, 32), navigation()
    policy = load_foreign(str(written(tmp_path)))
    assert policy.layout == LAYOUT
    expected = LearnedPolicy.of(weights, worlds).act(worlds.world, RNG)
    made = policy.make(worlds).act(worlds.world, RNG)
    np.testing.assert_allclose(made, expected, atol=1e-6)


def test_any_number_of_robots_is_a_batch(tmp_path: Path) -> None:
    policy = OnnxPolicy(written(tmp_path), navigation().observe)
    for number in (0, 1, 7):
        observation = np.zeros((number, LAYOUT.size), np.float32)
        command = policy.command(observation, np.full(number, 0.2), np.full(number, 2.5))
        assert command.shape == (number, 2)


def test_the_contract_tells_what_every_number_means() -> None:
    model = onnx.load_from_string(to_onnx(make(4)))
    texts = {each.key: each.value for each in model.metadata_props}
    said = json.loads(texts["safefilter"])
    assert said == contract(make(4))
    blocks = said["weights"]["observation"]["blocks"]
    assert blocks[0]["fields"] == list(OWN_FIELDS)
    assert sum(int(np.prod(block["shape"])) for block in blocks) == LAYOUT.size
    assert set(said["inputs"]) == {each.name for each in model.graph.input}
    assert set(said["output"]) == {each.name for each in model.graph.output}
    assert said["weights"]["card"]["name"] == "learned"


@pytest.mark.filterwarnings("ignore:.torch.jit.load. is deprecated:DeprecationWarning")
def test_torchscript_holds_the_contract_too(tmp_path: Path) -> None:
    path = tmp_path / "policy.pt"
    path.write_bytes(to_torchscript(make(4)))
    texts = {"safefilter.json": ""}
    torch.jit.load(path, _extra_files=texts)  # type: ignore[no-untyped-call]  # torch has no types there
    assert json.loads(texts["safefilter.json"]) == contract(make(4))


def test_the_command_line_writes_checks_and_says_so(tmp_path: Path) -> None:
    weights, out = tmp_path / "policy.safetensors", tmp_path / "policy.onnx"
    write_weights(weights, make(16))
    console = Console(record=True, width=200)
    main(Settings(weights, out), console)
    assert "greatest difference to the weights over 1000 observations" in console.export_text()
    assert OnnxPolicy(out, navigation().observe).layout == LAYOUT


def test_an_export_that_differs_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export_module, "TOLERANCE", -1.0)
    with pytest.raises(ExportDiffers, match="commands differ from those of the weights by"):
        export(make(4), tmp_path / "policy", "onnx")


def test_an_exported_policy_runs_without_torch(tmp_path: Path) -> None:
    code = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("torch", "onnx"):
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Absent())
import numpy as np
from policies.onnx_policy import OnnxPolicy
policy = OnnxPolicy({str(written(tmp_path))!r}, None)
print(policy.command(np.zeros((2, policy.layout.size)), np.ones(2), np.ones(2)).shape)
"""
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert result.stdout == "(2, 2)\n", result.stderr


def test_files_that_are_no_policy_are_named(tmp_path: Path) -> None:
    observe = navigation().observe
    with pytest.raises(CheckpointMissing, match="there is no such file"):
        OnnxPolicy(tmp_path / "none.onnx", observe)
    path = written(tmp_path)
    whole = path.read_bytes()
    for content in (b"", b"\x00", whole[:100], whole[: len(whole) // 2], b"PK\x03\x04 a zip"):
        path.write_bytes(content)
        with pytest.raises(CheckpointForeign, match="no policy that this package exported"):
            OnnxPolicy(path, observe)
    path.write_bytes(whole.replace(b"linear_0", b"linear_9", 1))
    with pytest.raises(CheckpointAltered, match="changed after it was written; export it again"):
        OnnxPolicy(path, observe)
    path.write_bytes(sealed(b"no model\n\x06sha256\x12\x40" + BLANK.encode()))
    with pytest.raises(CheckpointAltered, match="no ONNX model that can be run"):
        OnnxPolicy(path, observe)
    model = onnx.load_from_string(whole)
    del model.metadata_props[:]
    path.write_bytes(model.SerializeToString())
    with pytest.raises(CheckpointForeign, match=r"make it with python -m policies\.export"):
        OnnxPolicy(path, observe)


def test_large_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("policies.onnx_policy.MAX_BYTES", 100)
    with pytest.raises(CheckpointTooLarge, match="expected at most 100"):
        OnnxPolicy(written(tmp_path), navigation().observe)


def test_other_contracts_are_refused() -> None:
    good = contract(make(4))
    faults = {
        "no contract of an exported policy": "[]",
        "version 1, got .* of version 2; export the weights again": json.dumps({
            **good,
            "version": 2,
        }),
        "FILE: expected version 1, got None": json.dumps({**good, "weights": {}}),
    }
    for message, text in faults.items():
        with pytest.raises(CheckpointForeign, match=message):
            layout_of_contract(text, "FILE")


def test_other_worlds_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    other = navigation(ObservationLayout())
    with pytest.raises(TensorError, match="the navigation gives"):
        OnnxPolicy.of(path, other)
    with pytest.raises(ShapeError, match="observations: expected shape"):
        OnnxPolicy(path, other.observe).act(other.world, RNG)
    holonomic = Navigation(Crossroad(), layout=LAYOUT)
    holonomic.reset(0)
    with pytest.raises(InvalidInput, match="kinematics='differential'"):
        OnnxPolicy.of(path, holonomic).act(holonomic.world, RNG)

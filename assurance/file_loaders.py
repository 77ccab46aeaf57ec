"""Every kind of file that is read here: how a usable one is written, and how it is read.

A file that others may have made, or that a disk has spoilt, is handed to a loader as it is: what comes out is what was
written, or an error of `safefilter.errors` that names the file.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
import yaml

from envs.observation_layout import ObservationLayout
from envs.recording import Moment, Setting
from envs.recording_file import RecordingWriter, read_recording
from envs.robot_results import Fate, RobotResults
from envs.scenarios import load_scenario
from envs.scenarios.library import LIBRARY
from policies.card import Card
from policies.checkpoint import described, read_weights, write_weights
from policies.curves import read_curves
from policies.foreign_policy import load_foreign
from policies.methods import METHODS
from policies.onnx_export import to_onnx
from policies.onnx_policy import OnnxPolicy
from policies.policy_weights import Weights
from policies.settings_file import plain_settings, read_settings
from policies.ship import read_rows
from policies.table_cell import Cell, CellFolder
from policies.training_checkpoint import TrainingCheckpoints
from policies.training_settings import TrainingSettings
from safefilter.comparison.problem_file import line_of, read_problems, write_problems
from safefilter.comparison.shipped import shipped_set


@dataclass(frozen=True, slots=True)
class FileLoader:
    """One kind of file.

    Attributes:
        name: What it is called here.
        file: The file that is damaged, below a folder.
        write: Writes it, and what belongs to it, into an empty folder.
        load: Reads it; returns what came of it as a text, so that two readings can be compared.
        is_sealed: Does a checksum tell any change?
    """

    name: str
    file: str
    write: Callable[[Path], None]
    load: Callable[[Path], str]
    is_sealed: bool = False


LAYOUT = ObservationLayout(num_neighbours=1, num_beams=4)
CELL = Cell(METHODS["nh-orca"], "overtaking", episodes=2, seed=5)


def small_weights() -> Weights:
    """Weights of a network of two layers with 3 numbers between."""
    rng = np.random.default_rng(0)
    shapes = {
        "actor.0.weight": (3, LAYOUT.size),
        "actor.0.bias": (3,),
        "actor.2.weight": (2, 3),
        "actor.2.bias": (2,),
        "log_std": (2,),
    }
    arrays = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    return Weights(arrays, LAYOUT, Card(name="small", limits=("none",)))


def small_results() -> RobotResults:
    """Results of two robots in two episodes."""
    ones, reals = np.ones((2, 2), dtype=np.int64), np.ones((2, 2))
    return RobotResults(
        fate=Fate.SUCCESS * ones,
        time=20.0 * reals,
        passings=ones,
        passings_on_right=ones.copy(),
        overtakings=0 * ones,
        overtakings_on_left=0 * ones,
        detour=reals,
        min_clearance=0.01 * reals,
        min_wall_clearance=np.inf * reals,
        decisions=10 * ones,
        interventions=3 * ones,
        action_variation=0.1 * reals,
    )


def _write_recording(folder: Path) -> None:
    two, flags = np.array([0.1, 0.2]), np.array([False, True])
    setting = Setting(
        scenario="passing",
        seed=3,
        dt=0.2,
        has_heading=True,
        goal=np.eye(2),
        radius=two,
        v_max=two,
        priority=1.0 + two,
        person=flags,
        walls=np.array([[[0.0, 1.0], [2.0, 3.0]]]),
    )
    with RecordingWriter(folder / "episode.jsonl", setting) as writer:
        for step in range(3):
            writer.write(
                Moment(
                    step=step,
                    position=step * np.eye(2),
                    heading=two,
                    arrived=flags,
                    collided=~flags,
                    present=flags,
                    action=0.1 * np.eye(2),
                    case=np.array([1, 2]),
                )
            )


def _read_recording(folder: Path) -> str:
    recording = read_recording(folder / "episode.jsonl")
    return repr([np.asarray(value).tolist() for value in astuple(recording)[1:]])


def _write_training(folder: Path) -> None:
    state = {"curve": [{"num_steps": 1.0}], "arrays": (np.arange(3.0), np.array([True])), 7: None}
    TrainingCheckpoints(folder).write(12, state)


def _write_settings(folder: Path) -> None:
    text = yaml.safe_dump(plain_settings(TrainingSettings()))
    (folder / "settings.yaml").write_text(text, encoding="utf-8")


def _write_curves(folder: Path) -> None:
    (folder / "srl-1").mkdir()
    points = [{"num_steps": 10.0, "success": 0.5}, {"num_steps": 20.0, "success": 0.75}]
    (folder / "srl-1" / "curve.json").write_text(json.dumps(points), encoding="utf-8")


def _write_rows(folder: Path) -> None:
    rows = [{"scenario": "passing", "success_rate": 0.5, "episodes": 3}]
    (folder / "rows.json").write_text(json.dumps(rows), encoding="utf-8")


def _write_onnx(folder: Path) -> None:
    (folder / "policy.onnx").write_bytes(to_onnx(small_weights()))


def _write_layout(folder: Path) -> None:
    (folder / "layout.yaml").write_bytes((LIBRARY / "n_c_o_intersection.yaml").read_bytes())


def _read_problems(folder: Path) -> str:
    problems = read_problems(folder / "problems.jsonl")
    truths = {number: astuple(truth) for number, truth in problems.truths.items()}
    return repr((
        problems.name,
        problems.description,
        problems.unit,
        [line_of(problem) for problem in problems.problems],
        truths,
    ))


def _nothing() -> np.typing.NDArray[np.float32]:
    return np.zeros((0, 0, 0), dtype=np.float32)


FILE_LOADERS = (
    FileLoader(
        "weights",
        "small.safetensors",
        lambda folder: write_weights(folder / "small.safetensors", small_weights()),
        lambda folder: repr(described(read_weights(folder / "small.safetensors"))),
        is_sealed=True,
    ),
    FileLoader(
        "card of weights",
        "small.json",
        lambda folder: write_weights(folder / "small.safetensors", small_weights()),
        lambda folder: repr(described(read_weights(folder / "small.safetensors"))),
        is_sealed=True,
    ),
    FileLoader(
        "checkpoint of a training",
        "training-000000000012.safetensors",
        _write_training,
        lambda folder: repr(TrainingCheckpoints(folder).read().state),
        is_sealed=True,
    ),
    FileLoader(
        "exported policy",
        "policy.onnx",
        _write_onnx,
        lambda folder: repr(OnnxPolicy(folder / "policy.onnx", _nothing).layout),
        is_sealed=True,
    ),
    FileLoader(
        "policy of somebody else",
        "policy.onnx",
        _write_onnx,
        lambda folder: repr(load_foreign(str(folder / "policy.onnx")).layout),
    ),
    FileLoader("recording", "episode.jsonl", _write_recording, _read_recording, is_sealed=True),
    FileLoader(
        "layout",
        "layout.yaml",
        _write_layout,
        lambda folder: repr(load_scenario(folder / "layout.yaml")),
    ),
    FileLoader(
        "settings of a training",
        "settings.yaml",
        _write_settings,
        lambda folder: repr(plain_settings(read_settings(folder / "settings.yaml"))),
    ),
    FileLoader(
        "problems",
        "problems.jsonl",
        lambda folder: write_problems(folder / "problems.jsonl", shipped_set("barriers_3")),
        _read_problems,
    ),
    FileLoader(
        "cell of the table",
        CellFolder(Path()).file_of(CELL).name,
        lambda folder: CellFolder(folder).write(CELL, small_results()),
        lambda folder: repr(CellFolder(folder).read(CELL)),
        is_sealed=True,
    ),
    FileLoader(
        "rows of the table",
        "rows.json",
        _write_rows,
        lambda folder: repr(read_rows(folder / "rows.json")),
    ),
    FileLoader(
        "learning curve",
        "srl-1/curve.json",
        _write_curves,
        lambda folder: repr(read_curves("srl", folder)),
    ),
)

"""Export a trained policy: ``python -m policies.export weights.safetensors --format onnx --out FILE``.

The file holds the actor, the action map, and the contract: what every number of an observation means, in which order
they stand, and what comes out. What is written is read again and compared with `LearnedPolicy` before the command ends.

Letters: B robots, F numbers of an observation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import numpy as np
import tyro
from rich.console import Console

from envs.observation_layout import Observations
from policies.atomic_file import write_atomically
from policies.checkpoint import read_weights
from policies.checkpoint_errors import CheckpointError
from policies.learned_policy import LearnedPolicy
from policies.policy_weights import Weights
from safefilter.arrays import FloatArray

Format = Literal["onnx", "torchscript"]
Commands: TypeAlias = Callable[[Observations, FloatArray, FloatArray], FloatArray]

TOLERANCE = 1e-6
"""Largest difference of a command, over v_max and omega_max: some roundings of float32."""
NUM_CHECKED = 1000


@dataclass(frozen=True, slots=True)
class Settings:
    """Write a trained policy for other programs.

    Attributes:
        weights: File ``NAME.safetensors``.
        out: File to write.
        format: ONNX needs no torch, neither to write nor to run; TorchScript is for LibTorch.
    """

    weights: Annotated[Path, tyro.conf.Positional]
    out: Path
    format: Format = "onnx"


class ExportDiffers(CheckpointError):
    """What was exported does not do what the weights do."""


def export(weights: Weights, path: Path, kind: Format) -> float:
    """Write a policy, read it again and compare.

    Args:
        weights: What was learnt.
        path: File to write.
        kind: What kind of file.

    Returns:
        Greatest difference of a command over random observations, over v_max and omega_max.

    Raises:
        ExportDiffers: If it is above `TOLERANCE`.
    """
    if kind == "onnx":
        # Each kind needs packages that the other does not.
        content = import_module("policies.onnx_export").to_onnx(weights)
        write_atomically(path, content)
        commands = import_module("policies.onnx_policy").OnnxPolicy(path, _nothing).command
    else:
        torchscript = import_module("policies.torchscript_export")
        write_atomically(path, torchscript.to_torchscript(weights))
        commands = torchscript.commands_of(path)
    difference = greatest_difference(weights, commands)
    if difference > TOLERANCE:
        raise ExportDiffers(
            f"{path}: commands differ from those of the weights by {difference:.2g}; expected at most {TOLERANCE:g}"
        )
    return difference


def greatest_difference(weights: Weights, commands: Commands) -> float:
    """How far an exported policy is from `LearnedPolicy`, over observations within [-1, 1].

    Args:
        weights: What was learnt.
        commands: The exported policy.

    Returns:
        Greatest difference of a command, over v_max and omega_max.
    """
    rng = np.random.default_rng(0)
    observation = rng.uniform(-1.0, 1.0, (NUM_CHECKED, weights.layout.size)).astype(np.float32)
    limits = rng.uniform(0.05, 3.0, (2, NUM_CHECKED))
    expected = LearnedPolicy(weights, _nothing).command(observation, *limits)
    difference = np.abs(commands(observation, *limits) - expected) / limits.T
    return float(difference.max())


def _nothing() -> Observations:
    return np.zeros((0, 0, 0), dtype=np.float32)


def main(settings: Settings, console: Console) -> None:
    """Export, and say what came of it.

    Args:
        settings: What to export.
        console: Where to print.
    """
    difference = export(read_weights(settings.weights), settings.out, settings.format)
    console.print(
        f"wrote {settings.out} ({settings.out.stat().st_size / 1e6:.2f} MB); greatest difference to the weights "
        f"over {NUM_CHECKED} observations: {difference:.1e} of v_max and omega_max",
        highlight=False,
    )


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())

"""TorchScript: the deterministic policy for C++ and for robots that run LibTorch, with the contract inside.

Letters: B robots, F numbers of an observation.
"""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from envs.observation_layout import Observations
from policies.contract import METADATA, contract
from policies.policy_weights import Weights
from safefilter.arrays import FloatArray


class DeterministicPolicy(nn.Module):
    """The actor, and the action map behind it.

    Attributes:
        actor: From observations (B, F) to raw actions (B, 2).
    """

    def __init__(self, weights: Weights) -> None:
        """Copy weights.

        Args:
            weights: What was learnt.
        """
        super().__init__()
        layers: list[nn.Module] = []
        for weight, bias in weights.layers:
            linear = nn.Linear(weight.shape[1], weight.shape[0])
            linear.load_state_dict({"weight": torch.tensor(weight), "bias": torch.tensor(bias)})
            layers += [linear, nn.ReLU()]
        self.actor = nn.Sequential(*layers[:-1])

    def forward(self, observation: Tensor, v_max: Tensor, omega_max: Tensor) -> Tensor:
        """Commands of the mean action; `policies.action_map.to_command` in torch.

        Args:
            observation: Shape (B, F).
            v_max: Greatest speeds, shape (B,), in m/s.
            omega_max: Greatest turn rates, shape (B,), in rad/s.

        Returns:
            Shape (B, 2), in m/s and rad/s.
        """
        within = self.actor(observation).clamp(-1.0, 1.0)
        return torch.stack([v_max * (0.5 + 0.5 * within[:, 0]), omega_max * within[:, 1]], dim=1)


def to_torchscript(weights: Weights) -> bytes:
    """The policy as a TorchScript archive.

    Args:
        weights: What was learnt.

    Returns:
        Content of a file for ``torch.jit.load`` and ``torch::jit::load``; the contract is its extra file
        ``safefilter.json``.
    """
    buffer = io.BytesIO()
    with _despite_deprecation(), torch.no_grad():
        scripted = torch.jit.script(DeterministicPolicy(weights).eval().requires_grad_(False))
        extra = {f"{METADATA}.json": json.dumps(contract(weights))}
        torch.jit.save(scripted, buffer, _extra_files=extra)
    return buffer.getvalue()


def commands_of(path: Path) -> Callable[[Observations, FloatArray, FloatArray], FloatArray]:
    """Read an archive again. It is code: read none that you do not trust.

    Args:
        path: File that holds what `to_torchscript` returned.

    Returns:
        From observations (B, F), v_max (B,) and omega_max (B,) to commands (B, 2).
    """
    with _despite_deprecation():
        policy = torch.jit.load(path)  # type: ignore[no-untyped-call]  # torch has no types there

    def commands(observation: Observations, v_max: FloatArray, omega_max: FloatArray) -> FloatArray:
        given = (
            torch.tensor(array, dtype=torch.float32) for array in (observation, v_max, omega_max)
        )
        command: FloatArray = policy(*given).numpy().astype(np.float64)
        return command

    return commands


@contextmanager
def _despite_deprecation() -> Iterator[None]:
    """PyTorch asks to move on to torch.export, whose archives LibTorch cannot run without a compiler on the robot."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"`torch\.jit\.", DeprecationWarning)
        yield

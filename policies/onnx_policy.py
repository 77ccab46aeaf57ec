"""OnnxPolicy: an exported policy drives; onnxruntime evaluates it, without torch.

Letters: W worlds, N robots a world, F numbers of an observation, B robots.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Self

import numpy as np
import onnxruntime
from onnxruntime.capi import onnxruntime_pybind11_state as runtime

from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout, Observations
from envs.world import World
from policies.checkpoint_errors import CheckpointAltered, CheckpointForeign
from policies.contract import INPUTS, METADATA, OUTPUT, layout_of_contract
from policies.learned_policy import checked_observations, require_layout
from policies.onnx_seal import is_intact
from policies.tensor_file import read_limited
from safefilter.arrays import FloatArray

RUNTIME_ERRORS = (
    runtime.Fail,
    runtime.InvalidArgument,
    runtime.InvalidGraph,
    runtime.InvalidProtobuf,
    runtime.NotImplemented,
    runtime.RuntimeException,
    UnicodeDecodeError,  # of names that are no texts
)
"""What handing the runtime a file of another kind ends in."""
MAX_BYTES = 64 * 2**20
"""Largest file that is read."""


class OnnxPolicy:
    """Commands of an exported network for differential drives.

    Attributes:
        name: What the policy is called in tables.
        layout: What it observes.
    """

    def __init__(
        self, path: str | Path, observe: Callable[[], Observations], *, name: str | None = None
    ) -> None:
        """Read a file that `policies.export` wrote.

        Args:
            path: File ``.onnx``.
            observe: Gives the observations of all robots now, shape (W, N, F): such as `Navigation.observe`.
            name: What the policy is called in tables; by default as the file.

        Raises:
            CheckpointMissing: If there is no such file.
            CheckpointTooLarge: If it is larger than anything exported here.
            CheckpointAltered: If it was changed, or is no ONNX model that can be run.
            CheckpointForeign: If it is none of ours, or for other observations.
            CheckpointError: If it cannot be read.
        """
        path = Path(path)
        self.name = path.stem if name is None else name
        self._observe = observe
        self._session, self.layout = _opened(path)

    @staticmethod
    def layout_of(path: str | Path) -> ObservationLayout:
        """What an exported policy observes.

        Args:
            path: File ``.onnx``.

        Raises:
            CheckpointError: If the file cannot be used; see the constructor.
        """
        return _opened(Path(path))[1]

    @classmethod
    def of(cls, path: str | Path, navigation: Navigation, *, name: str | None = None) -> Self:
        """Drive the robots of a navigation.

        Args:
            path: File ``.onnx``.
            navigation: Worlds that the policy observes.
            name: What the policy is called in tables; by default as the file.

        Raises:
            TensorError: If the navigation's observations are laid out differently.
            CheckpointError: If the file cannot be used; see the constructor.
        """
        policy = cls(path, navigation.observe, name=name)
        require_layout(policy.layout, navigation)
        return policy

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        """Commands (v, w), shape (W, N, 2); zero for robots that are not under way.

        Raises:
            InvalidInput: If robots are not differential drives.
            ShapeError: If the observations are of another shape.
        """
        observation = checked_observations(self._observe(), world, self.layout)
        under_way = world.active
        action = np.zeros((*under_way.shape, 2))
        action[under_way] = self.command(
            observation[under_way], world.v_max[under_way], world.omega_max[under_way]
        )
        return action

    def command(
        self, observation: Observations, v_max: FloatArray, omega_max: FloatArray
    ) -> FloatArray:
        """Commands of B robots, for use without a world.

        Args:
            observation: Shape (B, F).
            v_max: Greatest speeds, shape (B,), in m/s.
            omega_max: Greatest turn rates, shape (B,), in rad/s.

        Returns:
            Shape (B, 2), in m/s and rad/s.
        """
        given = (observation, v_max, omega_max)
        inputs = {
            name: np.ascontiguousarray(array, dtype=np.float32)
            for name, array in zip(INPUTS, given, strict=True)
        }
        (command,) = self._session.run([OUTPUT], inputs)
        return np.asarray(command, dtype=np.float64)


def _opened(path: Path) -> tuple[onnxruntime.InferenceSession, ObservationLayout]:
    """What evaluates the policy, and what that observes.

    Raises:
        CheckpointAltered: If it was changed, or is no ONNX model that can be run.
        CheckpointForeign: If it is none of ours.
    """
    content = read_limited(path, MAX_BYTES)
    whole = is_intact(content)
    if whole is None:
        raise CheckpointForeign(
            f"{path}: no policy that this package exported, or one that was cut; make it with python -m policies.export"
        )
    if not whole:
        raise CheckpointAltered(f"{path}: changed after it was written; export it again")
    options = onnxruntime.SessionOptions()
    # Networks this small are done before a second thread has been woken.
    options.intra_op_num_threads = 1
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except RUNTIME_ERRORS as error:
        raise CheckpointAltered(f"{path}: no ONNX model that can be run: {error}") from error
    texts = session.get_modelmeta().custom_metadata_map
    return session, layout_of_contract(texts.get(METADATA, ""), str(path))

"""Foreign policies: trained or written elsewhere, and named by where they are.

* ``package.module:callable``: called with the `Navigation` of a run, it returns a `Policy`. An attribute ``layout`` of
  it says what is observed, if not the usual.
* ``weights.safetensors``: of `policies.train`.
* ``policy.onnx``: from observations (B, F) in float32 to actions (B, 2), or what `policies.export` wrote; run by
  onnxruntime.
* ``policy.zip``: of Stable-Baselines3, trained in ``envs:*-v0``. Such files hold pickles, which execute whatever their
  author wanted as they are read: they are opened only if the user has said that this author is trusted.

Actions of files are commands (v, w), as in ``envs:*-v0``; an ONNX output called ``raw`` is in [-1, 1], see
`policies.action_map`.

Letters: F numbers of an observation, B robots.
"""

from __future__ import annotations

import importlib
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout, Observations
from policies.checkpoint import read_weights
from policies.contract import INPUTS
from policies.evaluation import PolicyFactory
from policies.learned_policy import LearnedPolicy
from policies.observation_policy import ObservationPolicy, layout_of_size
from policies.policy import Policy
from safefilter.bounded_file import require_bounded
from safefilter.errors import InvalidInput, SafeFilterError

RAW_OUTPUT = "raw"
MAX_ONNX_BYTES = 2**31
"""Largest file that is read: that of the format."""
SB3_PART = "data"
"""Part of every zip of Stable-Baselines3."""
SUFFIXES = (".safetensors", ".onnx", ".zip")


class PolicyNotTrusted(InvalidInput):
    """The file can execute code as it is read, and nobody has said that it may."""


class PolicyPackageMissing(SafeFilterError, ImportError):
    """The package that runs this kind of policy is not installed."""


@dataclass(frozen=True, slots=True)
class ForeignPolicy:
    """A policy that can be driven with.

    Attributes:
        name: What it is called in tables.
        make: Makes it for a run.
        layout: What it observes; None: nothing, or the usual.
    """

    name: str
    make: PolicyFactory
    layout: ObservationLayout | None


def load_foreign(
    source: str, *, algorithm: str = "PPO", trusts_pickle: bool = False
) -> ForeignPolicy:
    """Load a policy by where it is.

    Args:
        source: See the module docstring.
        algorithm: Class of Stable-Baselines3 that wrote a zip.
        trusts_pickle: May a zip execute code?

    Raises:
        InvalidInput: If there is no such policy, or it observes something else.
        CheckpointError: If weights cannot be used.
        PolicyNotTrusted: If it is a zip, and nobody has said that it may execute code.
        PolicyPackageMissing: If the package that runs it is not installed.
    """
    path = Path(source)
    if path.suffix not in SUFFIXES:
        return _load_callable(source)
    if not path.is_file():
        raise InvalidInput(f"{source}: there is no such file")
    if path.suffix == ".safetensors":
        weights = read_weights(path)
        return ForeignPolicy(
            weights.card.name,
            lambda navigation: LearnedPolicy.of(weights, navigation),
            weights.layout,
        )
    if path.suffix == ".onnx":
        return _load_onnx(path)
    if not trusts_pickle:
        raise PolicyNotTrusted(
            f"{source}: a zip of Stable-Baselines3 holds pickles, which can execute anything as they are read; "
            "if you trust whoever made it, say --trust-pickle"
        )
    return _load_sb3(path, algorithm)


def _load_callable(source: str) -> ForeignPolicy:
    module, colon, name = source.partition(":")
    if not colon:
        raise InvalidInput(
            f"policy {source!r}: expected package.module:callable, or a file that ends in {', '.join(SUFFIXES)}"
        )
    try:
        make = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InvalidInput(f"policy {source!r}: {error}") from error
    if not callable(make):
        raise InvalidInput(f"policy {source!r}: expected a callable, got {type(make).__name__}")

    def checked(navigation: Navigation) -> Policy:
        policy: Policy = make(navigation)
        if not callable(getattr(policy, "act", None)):
            raise InvalidInput(
                f"policy {source!r}: expected it to return a policy with act(world, rng), "
                f"got {type(policy).__name__}"
            )
        return policy

    return ForeignPolicy(name, checked, getattr(make, "layout", None))


def _load_onnx(path: Path) -> ForeignPolicy:
    runtime = _package("onnxruntime", f"{path}: ONNX")
    require_bounded(path, MAX_ONNX_BYTES)
    errors: tuple[type[Exception], ...] = importlib.import_module(
        "policies.onnx_policy"
    ).RUNTIME_ERRORS
    try:
        session: Any = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        inputs, outputs = session.get_inputs(), session.get_outputs()
    except errors as error:
        raise InvalidInput(f"{path}: no ONNX model that can be run: {error}") from error
    if tuple(each.name for each in inputs) == INPUTS:
        return _exported(path)
    if len(inputs) != 1 or len(inputs[0].shape) != 2 or not isinstance(inputs[0].shape[1], int):
        raise InvalidInput(
            f"{path}: expected one input of shape (B, F), got {[each.shape for each in inputs]}"
        )
    layout = layout_of_size(inputs[0].shape[1], str(path))
    names = [each.name for each in outputs]
    output = RAW_OUTPUT if RAW_OUTPUT in names else names[0]

    def predict(observation: Observations) -> Observations:
        given: Observations = session.run([output], {inputs[0].name: observation})[0]
        return given

    def make(navigation: Navigation) -> Policy:
        return ObservationPolicy(path.stem, predict, navigation, gives_raw=output == RAW_OUTPUT)

    return ForeignPolicy(path.stem, make, layout)


def _exported(path: Path) -> ForeignPolicy:
    """One of ours, which says itself what it observes."""
    kind = importlib.import_module("policies.onnx_policy").OnnxPolicy
    layout: ObservationLayout = kind.layout_of(path)
    return ForeignPolicy(path.stem, lambda navigation: kind.of(path, navigation), layout)


def _load_sb3(path: Path, algorithm: str) -> ForeignPolicy:
    package = _package("stable_baselines3", f"{path}: Stable-Baselines3")
    kind: Any = getattr(package, algorithm, None)
    if kind is None:
        raise InvalidInput(f"algorithm {algorithm!r}: Stable-Baselines3 has no such class")
    _require_whole(path)
    model: Any = kind.load(path, device="cpu")
    shape = model.observation_space.shape
    if shape is None or len(shape) != 1:
        raise InvalidInput(f"{path}: expected flat observations of shape (F,), got {shape}")
    layout = layout_of_size(shape[0], str(path))

    def predict(observation: Observations) -> Observations:
        given: Observations = np.asarray(model.predict(observation, deterministic=True)[0])
        return given

    def make(navigation: Navigation) -> Policy:
        return ObservationPolicy(path.stem, predict, navigation)

    return ForeignPolicy(path.stem, make, layout)


def _require_whole(path: Path) -> None:
    """All of an archive is as it was written.

    Raises:
        InvalidInput: If it is not, or is none.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            torn = archive.testzip()
            # A directory that was damaged may list fewer parts.
            if SB3_PART not in archive.namelist():
                torn = SB3_PART
    except (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError) as error:
        raise InvalidInput(f"{path}: no zip that can be read: {error}") from error
    if torn is not None:
        raise InvalidInput(f"{path}: its part {torn} is not as it was written; copy it again")


def _package(name: str, what: str) -> ModuleType:
    """Import a package that only this kind of policy needs.

    Raises:
        PolicyPackageMissing: If it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise PolicyPackageMissing(
            f"{what} needs {name}, which is not installed: pip install {name.replace('_', '-')}"
        ) from error

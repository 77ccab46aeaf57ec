"""Kept weights: where those of a training lie, those that come with this project first.

Letters: none.
"""

from __future__ import annotations

from pathlib import Path

from policies.checkpoint import read_weights
from policies.checkpoint_errors import CheckpointMissing
from policies.policy_weights import Weights

WEIGHTS = Path(__file__).parent / "weights"
"""Where the weights that come with this project are."""
RUNS = Path("runs")
"""Where `policies.train` leaves what it has trained."""
SHIPPED = ("srl-orca", 1)
"""Training and seed of the weights that are shipped under the plain name."""


def weights_paths(training: str, seed: int, folder: Path = WEIGHTS) -> tuple[Path, ...]:
    """Where weights are looked for, in order.

    Args:
        training: Preset of `policies.train`.
        seed: Of the training.
        folder: Where weights are kept.
    """
    stem = training.replace("-", "_")
    kept = folder / "seeds" / f"{stem}_{seed}.safetensors"
    trained = RUNS / f"{training}-{seed}" / "weights.safetensors"
    if (training, seed) == SHIPPED:
        return folder / f"{stem}.safetensors", kept, trained
    return kept, trained


def find_weights(training: str, seed: int, folder: Path = WEIGHTS) -> Weights:
    """Read the weights of a training.

    Args:
        training: Preset of `policies.train`.
        seed: Of the training.
        folder: Where weights are kept.

    Raises:
        CheckpointMissing: If there are none; says which command trains them.
        CheckpointError: If they cannot be used.
    """
    paths = weights_paths(training, seed, folder)
    for path in paths:
        if path.is_file():
            return read_weights(path)
    raise CheckpointMissing(
        f"no weights of {training}, seed {seed}: looked for {', '.join(map(str, paths))}; train them with "
        f"python -m policies.train {training} --settings.seed {seed}"
    )

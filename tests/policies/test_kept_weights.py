from collections.abc import Callable
from pathlib import Path

import pytest

from envs.observation_layout import ObservationLayout
from policies.checkpoint import write_weights
from policies.checkpoint_errors import CheckpointMissing
from policies.kept_weights import find_weights, weights_paths
from policies.policy_weights import Weights

MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]
LAYOUT = ObservationLayout()


def test_weights_are_found_by_training_and_seed(
    tmp_path: Path, constant_weights: MakeWeights, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for training, seed, path in (
        ("srl-orca", 1, "mine/srl_orca.safetensors"),
        ("srl-orca", 2, "mine/seeds/srl_orca_2.safetensors"),
        ("drl-cd", 3, "runs/drl-cd-3/weights.safetensors"),
    ):
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        write_weights(path, constant_weights((0.1 * seed, 0.0), LAYOUT))
        found = find_weights(training, seed, Path("mine"))
        assert found.arrays["actor.4.bias"][0] == pytest.approx(0.1 * seed)
        assert Path(path) in weights_paths(training, seed, Path("mine"))


def test_weights_that_are_not_there_are_named_with_what_trains_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CheckpointMissing) as caught:
        find_weights("drl-cf", 2, tmp_path)
    assert "no weights of drl-cf, seed 2" in str(caught.value)
    assert "python -m policies.train drl-cf --settings.seed 2" in str(caught.value)

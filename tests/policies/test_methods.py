from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from envs.observation_layout import ObservationLayout
from policies.checkpoint import write_weights
from policies.checkpoint_errors import CheckpointMissing
from policies.evaluation import make_navigation
from policies.hybrid import Hybrid
from policies.lateness import PUNCTUAL
from policies.learned_policy import LearnedPolicy
from policies.methods import METHODS, find_method, find_weights, policy_factory, weights_paths
from policies.nh_orca import NHORCA
from policies.policy_weights import Weights
from policies.presets import PRESETS
from policies.table_scenarios import find_scenario
from policies.unpin import Unpinned
from safefilter.errors import InvalidInput

MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]
LAYOUT = ObservationLayout()


def test_methods_are_found_by_their_names() -> None:
    assert all(find_method(name).name == name for name in METHODS)
    with pytest.raises(InvalidInput, match="method 'orca': expected one of nh-orca, drl-cf"):
        find_method("orca")


def test_whatever_is_learnt_has_a_preset_that_trains_it() -> None:
    trainings = {method.training for method in METHODS.values()} - {None}
    assert trainings <= set(PRESETS)
    assert {"srl-orca", "drl-cf", "drl-cd"} <= trainings


def test_what_is_compared_differs_in_what_it_says_and_nothing_else() -> None:
    ours = METHODS["srl-orca"]
    assert ours.filtering.walls == "lidar"
    assert METHODS["srl-orca-map"].filtering.walls == "map"
    assert METHODS["srl-orca-off"].filtering.kind == "off"
    assert METHODS["srl-orca-literal"].filtering.kind == "literal"
    for name, method in METHODS.items():
        if method.lateness == PUNCTUAL:
            continue
        prompt = METHODS[name.removesuffix("-late").removesuffix("-delayed")]
        assert replace(method, name="", label="", about="", lateness=PUNCTUAL) == replace(
            prompt, name="", label="", about=""
        )
    # Whose command has expired stops; the paper has no such thing.
    assert not METHODS["srl-orca-late"].lateness.repeats
    assert METHODS["srl-orca-literal-late"].lateness.repeats
    # A way out that knows nothing of safety needs a filter behind it.
    assert all(m.filtering.kind == "ours" for m in METHODS.values() if m.is_unpinned)


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


@pytest.mark.parametrize(
    ("name", "kind"),
    [("nh-orca", NHORCA), ("drl-cf", LearnedPolicy), ("hybrid-rl", Hybrid), ("srl-orca", Unpinned)],
)
def test_each_driver_is_made_for_a_run(
    name: str, kind: type, constant_weights: MakeWeights
) -> None:
    method = METHODS[name]
    weights = constant_weights((0.0, 0.0), LAYOUT) if method.training else None
    navigation = make_navigation(find_scenario("overtaking"), method.filtering)
    assert isinstance(policy_factory(method, weights)(navigation), kind)


def test_weights_go_with_what_is_learnt_alone(constant_weights: MakeWeights) -> None:
    weights = constant_weights((0.0, 0.0), LAYOUT)
    for name, given in (("nh-orca", weights), ("srl-orca", None)):
        with pytest.raises(
            InvalidInput, match=f"method '{name}': expected weights for what is learnt"
        ):
            policy_factory(METHODS[name], given)

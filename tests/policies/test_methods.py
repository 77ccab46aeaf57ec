from collections.abc import Callable
from dataclasses import replace

import pytest

from envs.observation_layout import ObservationLayout
from policies.evaluation import make_navigation
from policies.hybrid import Hybrid
from policies.lateness import PUNCTUAL
from policies.learned_policy import LearnedPolicy
from policies.methods import METHODS, find_method, policy_factory
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

"""Tests of the presets: each is what its name says, and differs from ours in that alone."""

import pytest

from policies.presets import PRESETS
from policies.settings_file import differences, plain_settings

OURS = plain_settings(PRESETS["srl-orca"])


def changed(name: str, other: str = "srl-orca") -> list[str]:
    """Names of the settings that differ."""
    told = differences(plain_settings(PRESETS[other]), plain_settings(PRESETS[name]))
    return [text.partition(":")[0] for text in told]


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("srl-orca", set()),
        ("short", {"num_steps"}),
        ("no-norms", {"num_steps", "reward.passing", "reward.overtaking"}),
        ("straight-direction", {"num_steps", "reward.way_direction"}),
        (
            "straight-progress",
            {"num_steps", "reward.forward", "reward.way", "reward.way_direction"},
        ),
        ("no-cap", {"num_steps", "filtering.kind", "filtering.leg"}),
        ("no-filter", {"num_steps", "filtering.kind", "filtering.leg"}),
        ("nearest-leg", {"num_steps", "filtering.leg"}),
        ("no-memory", {"num_steps", "layout.has_memory"}),
        ("with-trail", {"num_steps", "layout.has_trail"}),
    ],
)
def test_ablations_leave_out_one_thing_of_ours(name: str, names: set[str]) -> None:
    # Weights that are zero with us as well make no difference.
    assert set(changed(name)) <= names
    assert bool(changed(name)) == bool(names)


def test_without_norms_no_norm_is_paid() -> None:
    reward = PRESETS["no-norms"].reward
    assert (reward.norm, reward.passing, reward.overtaking) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", [name for name in PRESETS if name.startswith("drl")])
def test_policies_that_are_trained_alone_have_no_filter(name: str) -> None:
    assert PRESETS[name].filtering.kind == "off"


@pytest.mark.parametrize(
    ("driven", "free"), [("drl-cd", "drl-cf"), ("drl-cd-sparse", "drl-cf-sparse")]
)
def test_curiosity_driven_and_free_differ_in_curiosity_alone(driven: str, free: str) -> None:
    assert changed(driven, free) == ["curiosity"]
    assert PRESETS[free].curiosity is None
    assert PRESETS[driven].curiosity is not None


@pytest.mark.parametrize(
    ("sparse", "dense"), [("drl-cf-sparse", "drl-cf"), ("drl-cd-sparse", "drl-cd")]
)
def test_sparse_rewards_pay_neither_progress_nor_direction(sparse: str, dense: str) -> None:
    assert (PRESETS[sparse].reward.forward, PRESETS[sparse].reward.direction) == (0.0, 0.0)
    assert {name.partition(".")[0] for name in changed(sparse, dense)} == {"reward"}
    assert OURS["reward"] != plain_settings(PRESETS[sparse])["reward"]

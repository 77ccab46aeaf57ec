"""The change of velocity that Priority-ORCA asks for is the smallest: others are told."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.testing.smallest_change import WrongChange, assert_smallest_change
from safefilter.testing.strategies import crowded, head_on, scenes

TAU = 2.0


def check(scene: sf.Scene, orca: sf.PriorityORCA, *, is_shared: bool = False) -> int:
    assert scene.wanted is not None
    return assert_smallest_change(
        sf.SafetyFilter([orca], sf.Holonomic(1.0)),
        scene,
        scene.wanted[scene.cooperative],
        v_opt=scene.wanted if is_shared else scene.velocity,
        time_horizon=TAU,
    )


@settings(max_examples=50)
@given(st.one_of(scenes(), crowded(), head_on()), st.booleans())
def test_changes_lead_to_the_rim_of_the_velocity_obstacle(scene: sf.Scene, is_shared: bool) -> None:
    check(scene, sf.PriorityORCA(TAU, "shared" if is_shared else "current"), is_shared=is_shared)


def pair(*velocities: list[float]) -> sf.Scene:
    return sf.Scene.from_world([[0.0, 0.0], [3.0, 0.0]], velocities, 0.3, wanted=velocities)


def test_pairs_are_counted() -> None:
    assert check(pair([1.0, 0.0], [-1.0, 0.0]), sf.PriorityORCA(TAU)) == 1


def test_a_horizon_that_is_too_long_makes_a_change_without_need() -> None:
    with pytest.raises(WrongChange, match=r"robots 0 and 1: they do not meet within 2\.0 s"):
        check(pair([0.3, 0.0], [-0.3, 0.0]), sf.PriorityORCA(10.0 * TAU))


def test_a_horizon_that_is_too_short_makes_slack_of_what_should_be_effort_and_code_repeats_it() -> (
    None
):
    scene = pair([1.0, 0.0], [-1.0, 0.0])
    with pytest.raises(WrongChange, match=r"they meet within 2\.0 s, but .* slack") as caught:
        check(scene, sf.PriorityORCA(0.1))
    code = str(caught.value).split("to repeat it:\n")[1]
    names = {"Scene": sf.Scene, "np": np, "assert_smallest_change": assert_smallest_change}
    safety_filter = sf.SafetyFilter([sf.PriorityORCA(0.1)], sf.Holonomic(1.0))
    with pytest.raises(WrongChange) as again:
        exec(
            "\n".join(map(str.strip, code.splitlines())), {**names, "safety_filter": safety_filter}
        )
    assert str(again.value) == str(caught.value)


def test_the_leg_of_the_norm_is_not_the_nearest() -> None:
    # Passing on the left would be a small change; norm-1 asks for the right.
    scene = pair([1.0, 0.2], [-1.0, 0.0])
    check(scene, sf.PriorityORCA(TAU))
    with pytest.raises(WrongChange, match=r"less than .* m/s leads to the rim"):
        check(scene, sf.PriorityORCA(TAU, leg="norm"))

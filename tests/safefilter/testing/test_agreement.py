"""Backends that decide alike pass, and one that does not is named."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.testing.agreement import BackendsDisagree, assert_backends_agree
from safefilter.testing.faults import FAULTS
from safefilter.testing.strategies import actions, crowded, head_on

FAST = ("planar", "clarabel", "qpsolvers:daqp")


def filter_with(backend: str, v_max: float = 1.0) -> sf.SafetyFilter:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(0.2)]
    return sf.SafetyFilter(constraints, sf.Holonomic(v_max), backend=backend)


@settings(max_examples=10)
@given(st.data(), st.one_of(crowded(), head_on()))
def test_backends_agree(data: st.DataObject, scene: sf.Scene) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    answered = assert_backends_agree(filter_with, scene, action, backends=FAST)
    assert answered["planar"] == scene.cooperative.sum()


def meeting() -> sf.Scene:
    return sf.Scene.from_world([[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.3)


def test_every_backend_that_is_installed_is_asked() -> None:
    scene = meeting()
    answered = assert_backends_agree(filter_with, scene, scene.velocity)
    assert set(answered) == set(sf.available_backends())


def test_two_velocities_are_told_with_robot_backends_and_code() -> None:
    scene = meeting()

    def make_filter(backend: str) -> sf.SafetyFilter:
        return filter_with(backend, 0.5 if backend == "clarabel" else 1.0)

    with pytest.raises(
        BackendsDisagree,
        match=r"robot 0: 'planar' and 'clarabel' find velocities 0\.\d+ m/s apart",
    ) as caught:
        assert_backends_agree(make_filter, scene, scene.velocity, backends=FAST)
    code = str(caught.value).split("to repeat it:\n")[1]
    names = {"Scene": sf.Scene, "np": np, "assert_backends_agree": assert_backends_agree}
    with pytest.raises(BackendsDisagree) as again:
        exec("\n".join(map(str.strip, code.splitlines())), {**names, "make_filter": make_filter})
    assert str(again.value) == str(caught.value)


def test_two_cases_are_told() -> None:
    scene = meeting()

    def make_filter(backend: str) -> sf.SafetyFilter:
        horizon = 0.01 if backend == "clarabel" else 2.0
        return sf.SafetyFilter([sf.PriorityORCA(horizon)], sf.Holonomic(1.0), backend=backend)

    with pytest.raises(BackendsDisagree, match=r"robot 0: .* find different cases"):
        assert_backends_agree(make_filter, scene, scene.velocity, backends=FAST)


def test_an_answer_that_is_refused_is_not_counted() -> None:
    scene, liar = meeting(), "fault:Mirrors"
    sf.register_backend(liar, FAULTS[liar])
    asked = partial(assert_backends_agree, filter_with, scene, scene.velocity)
    assert asked(backends=("planar", liar)) == {"planar": 2, liar: 0}

from dataclasses import fields, replace

import numpy as np
import pytest

from envs.transition import VECTORS, Transition
from safefilter.errors import NotFinite, ShapeError


def at_rest() -> Transition:
    vector, number, flag = np.zeros((2, 3, 2)), np.ones((2, 3)), np.zeros((2, 3), dtype=np.bool_)
    return Transition(
        start=vector,
        before=vector,
        position=vector,
        velocity=vector,
        facing=vector,
        goal=vector,
        v_max=number,
        present=flag,
        under_way=flag,
        arrived=flag,
        hit_robot=flag,
        hit_wall=flag,
        timed_out=flag,
        correction=number,
        way=number,
    )


@pytest.mark.parametrize("name", [field.name for field in fields(Transition)])
def test_every_array_must_fit(name: str) -> None:
    step = at_rest()
    with pytest.raises(ShapeError, match=r"\(2, 3"):
        replace(
            step,
            **{name: getattr(step, name)[:1]}
            if name != "under_way"
            else {name: getattr(step, name)[:, :2]},
        )


@pytest.mark.parametrize("name", [*sorted(VECTORS), "v_max", "correction"])
def test_numbers_that_are_not_finite_are_refused(name: str) -> None:
    step = at_rest()
    with pytest.raises(NotFinite, match=name):
        replace(step, **{name: getattr(step, name) * np.nan})


def test_one_world_is_no_exception() -> None:
    with pytest.raises(ShapeError, match=r"under_way: expected shape \(W, N\)"):
        replace(at_rest(), under_way=np.zeros(3, dtype=np.bool_))

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import NotFinite, OutOfRange, ShapeError


def filter_of(*constraints: sf.Constraint, dimension: int, **settings: Any) -> sf.SafetyFilter:
    box = sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (dimension,), dtype=np.float64))
    return sf.SafetyFilter(constraints, box, backend="clarabel", **settings)


AT_LEAST = sf.LinearConstraint([[1.0, 0.0]], [0.5], name="at least")


class Remembers:
    """A constraint without rows that keeps what it was given."""

    name = "remembers"

    def __init__(self) -> None:
        self.given: list[tuple[object, FloatArray, IntArray]] = []

    def half_spaces(self, scene: object, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        self.given.append((scene, action, index))
        action[:] = 7.0  # a constraint that scribbles on its copy harms nobody
        rows = sf.HalfSpaces.everywhere(len(index), action.shape[1])
        return sf.HalfSpaces(
            rows.normals, rows.offsets, rows.hard, rows.present, rows.labels, (self.name,)
        )


def test_the_scene_reaches_the_constraints_as_it_is() -> None:
    spy, scene = Remembers(), object()
    action = np.array([[0.5, 0.0], [0.0, 0.5]])
    decision = filter_of(spy, dimension=2).decide(scene, action, [4, 2])
    (seen, wanted, index) = spy.given[0]
    assert seen is scene
    assert wanted.dtype == np.float64
    assert index.tolist() == decision.index.tolist() == [4, 2]
    assert decision.action.tolist() == action.tolist() == [[0.5, 0.0], [0.0, 0.5]]


def test_without_an_index_actions_are_about_the_first_entries() -> None:
    spy = Remembers()
    decision = filter_of(spy, dimension=2).decide(None, np.zeros((3, 2)))
    assert spy.given[0][2].tolist() == decision.index.tolist() == [0, 1, 2]


def test_no_action_is_a_batch_of_none() -> None:
    assert len(filter_of(AT_LEAST, dimension=2).decide(None, np.empty((0, 2)))) == 0


@pytest.mark.parametrize(
    "action", [np.zeros(3), np.zeros((1, 2)), np.zeros((1, 1, 3)), [["a", "b", "c"]], 0.0]
)
def test_an_action_of_another_shape_is_refused(action: npt.ArrayLike) -> None:
    with pytest.raises(ShapeError, match=r"action: expected numbers of shape \(B, 3\)"):
        filter_of(dimension=3).decide(None, action)


@pytest.mark.parametrize("index", [[0], [0.0, 1.0], [[0, 1]]])
def test_an_index_of_another_shape_is_refused(index: Any) -> None:
    with pytest.raises(ShapeError, match="index: expected an integer for each of 2 actions"):
        filter_of(dimension=2).decide(None, np.zeros((2, 2)), index)


def test_a_negative_index_is_refused() -> None:
    with pytest.raises(OutOfRange, match="index: expected entries from 0 up"):
        filter_of(dimension=2).decide(None, np.zeros((1, 2)), [-1])


def test_rows_of_another_size_are_refused() -> None:
    with pytest.raises(
        ShapeError, match="at least: expected rows for 1 decisions in 3 dimensions, got 1 in 2"
    ):
        filter_of(AT_LEAST, dimension=3).decide(None, np.zeros((1, 3)))


def test_an_action_that_is_not_finite_is_an_error_that_names_it() -> None:
    with pytest.raises(NotFinite, match=r"action of row 1: .*nan.*pass fallback="):
        filter_of(dimension=2).decide(None, [[0.0, 0.0], [0.0, np.nan]])


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_with_a_fallback_an_action_that_is_not_finite_is_replaced_by_it(wrong: float) -> None:
    safety = filter_of(AT_LEAST, dimension=2, fallback=[0.4, 0.3])
    action = np.array([[0.0, wrong], [0.6, 0.0]], np.float32)
    decision = safety.decide(None, action)
    assert decision.fault_names == ("ACTION_NOT_FINITE", "NONE")
    assert decision.action[0] == pytest.approx(np.array([0.5, 0.3]))
    assert decision.wanted[0] == pytest.approx(np.array([0.4, 0.3]))
    assert decision.certified.all()
    assert all(safety.certify(None, action, decision))

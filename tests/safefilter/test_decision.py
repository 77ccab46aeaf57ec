"""Decisions read well: lengths, interventions, names of faults."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from safefilter import Holonomic, LinearConstraint, SafetyFilter, Scene
from safefilter.decision import Case, Decision, Fault

EAST = [1.0, 0.0]
SCENE = Scene.from_world([[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]], np.zeros((3, 2)), 0.1)


def decision(num_decisions: int = 3) -> Decision:
    safety = SafetyFilter([LinearConstraint([EAST], [-1.0])], Holonomic(1.0))
    return safety.decide(SCENE, np.zeros((num_decisions, 2)), range(num_decisions))


def test_cases_are_those_of_algorithm_2() -> None:
    assert [(case.name, case.value) for case in Case] == [
        ("SAFE", 1),
        ("PROJECTED", 2),
        ("LEAST_VIOLATION", 3),
    ]


CONTRADICTION = LinearConstraint([EAST, [-1.0, 0.0]], [0.1, 0.1])


@pytest.mark.parametrize(
    ("constraint", "action", "case", "fault"),
    [
        (LinearConstraint([EAST], [-1.0]), EAST, Case.SAFE, Fault.NONE),
        (LinearConstraint([EAST], [-1.0]), [3.0, 0.0], Case.PROJECTED, Fault.NONE),
        (
            LinearConstraint([EAST, [-1.0, 0.0]], [0.1, 0.1], hard=False),
            EAST,
            Case.LEAST_VIOLATION,
            Fault.NONE,
        ),
        (LinearConstraint([EAST], [-1.0]), [math.nan, 0.0], Case.SAFE, Fault.ACTION_NOT_FINITE),
        (CONTRADICTION, EAST, Case.LEAST_VIOLATION, Fault.EMPTY_HARD_SET),
    ],
)
def test_kernels_use_the_numbers_of_cases_and_faults(
    constraint: LinearConstraint, action: list[float], case: Case, fault: Fault
) -> None:
    safety = SafetyFilter([constraint], Holonomic(1.0), fallback=[0.0, 0.0])
    made = safety.decide(Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1), [action])
    assert made.case.tolist() == [case]
    assert made.fault.tolist() == [fault]
    assert made.fault_names == (fault.name,)


def test_faults_fit_into_the_smallest_integers() -> None:
    assert [fault.value for fault in Fault] == list(range(len(Fault)))
    assert max(Fault) <= np.iinfo(np.int8).max


def test_a_decision_is_as_long_as_its_batch() -> None:
    assert [len(decision(size)) for size in range(4)] == [0, 1, 2, 3]


def test_only_corrections_are_interventions() -> None:
    made = dataclasses.replace(decision(), correction=np.array([0.0, 1e-300, 0.1]))
    assert made.intervened.tolist() == [False, True, True]


def test_every_fault_has_its_name() -> None:
    faults = np.array(list(Fault), dtype=np.int8)
    made = dataclasses.replace(decision(), fault=faults)
    assert made.fault_names == tuple(Fault.__members__)


def test_decisions_cannot_be_altered() -> None:
    made = decision()
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.backend = "other"  # type: ignore[misc]  # that is the point


def test_a_column_is_cut_once_and_kept() -> None:
    made = decision()
    assert made.certified is made.certified
    assert made.active.shape == (3, 2, 2)
    assert made.proof.shape == (3, 3, 2)
    with pytest.raises(AttributeError, match="has no attribute 'certificate'"):
        _ = made.certificate  # type: ignore[attr-defined]  # there is none


@pytest.mark.parametrize("again", [copy.deepcopy, lambda made: pickle.loads(pickle.dumps(made))])
def test_a_copy_has_the_columns_that_nobody_asked_for_so_far(
    again: Callable[[Decision], Decision],
) -> None:
    made = decision()
    other = again(made)
    for field in dataclasses.fields(Decision):
        value, copied = getattr(made, field.name), getattr(other, field.name)
        assert np.array_equal(value, copied)
    assert repr(other) == repr(made)

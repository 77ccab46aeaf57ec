from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.decision_check import MOST_TRIED, _Claim, _on_rows, check_decision, refused
from safefilter.testing.strategies import crowded, scenes

SAFETY = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
SCENE = sf.Scene.from_world(
    [[0.0, 0.0], [0.3, 0.05], [-0.28, 0.1], [0.05, -0.3], [0.02, 0.32], [3.0, 3.0]],
    [[0.05, 0.0], [-0.2, 0.0], [0.2, -0.02], [0.0, 0.2], [0.0, -0.2], [0.0, 0.0]],
    0.105,
)
WANTED = np.full((6, 2), 0.1)
DECISION = SAFETY.decide(SCENE, WANTED)


def verdict(decision: sf.Decision, k: int) -> sf.Certificate:
    rows = SAFETY.half_spaces(SCENE, WANTED)
    return check_decision(rows, WANTED, decision, k, 0.21, exact=True)


def test_every_case_is_there_and_certifies() -> None:
    assert set(DECISION.case.tolist()) >= {1, 3}
    assert all(verdict(DECISION, k) for k in range(6))


def test_case_1_with_multipliers_is_refused() -> None:
    multipliers = DECISION.multipliers.copy()
    active = DECISION.active.copy()
    multipliers[5, 0], active[5, 0] = 0.1, (0, 0)
    wrong = verdict(replace(DECISION, multipliers=multipliers, active=active), 5)
    assert not wrong
    assert wrong.reason == "Case-1 holds the wanted velocity, but comes with multipliers"


def test_case_3_without_a_proof_is_refused() -> None:
    nothing = np.zeros_like(DECISION.proof_multipliers)
    k = int(np.flatnonzero(DECISION.case == 3)[0])
    assert not verdict(replace(DECISION, proof_multipliers=nothing), k)


def test_a_label_that_no_row_has_is_refused() -> None:
    k = int(np.flatnonzero(DECISION.case == 3)[0])
    active = DECISION.active.copy()
    active[k, 0] = (77, 77)
    assert not verdict(replace(DECISION, active=active), k)


@pytest.mark.parametrize("exact", [True, False])
def test_a_refusal_says_why(exact: bool) -> None:
    certificate = refused("because", exact=exact)
    assert (bool(certificate), certificate.reason, certificate.exact) == (False, "because", exact)


UNCERTAIN = [
    sf.Uncertainty(position_error=0.02),
    sf.Uncertainty(position_error=0.05, observation_delay=0.1, lost_messages=1),
    sf.Uncertainty(heading_error=0.1, actuation_error=0.1),
]


@given(
    scene=scenes() | crowded(),
    uncertainty=st.sampled_from(UNCERTAIN),
    seed=st.integers(0, 2**32),
)
def test_rows_of_one_neighbour_share_a_label_and_certify(
    scene: sf.Scene, uncertainty: sf.Uncertainty, seed: int
) -> None:
    separation = sf.Separation(0.2, uncertainty=uncertainty)
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0), separation], sf.Holonomic(0.2))
    index = np.flatnonzero(scene.cooperative)
    wanted = np.random.default_rng(seed).uniform(-0.3, 0.3, (len(index), 2))
    decision = safety.decide(scene, wanted)
    certificates = safety.certify(scene, wanted, decision)
    assert [certificate.reason for certificate in certificates] == [""] * len(index)


def alike(num_others: int) -> sf.HalfSpaces:
    """Rows of one label through (0.1, 0.1): two that hold (1, 2) off, and others that also touch that corner."""
    angle = np.linspace(np.pi, 1.5 * np.pi, 2 + num_others)[[0, -1, *range(1, 1 + num_others)]]
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)[np.newaxis]
    size = 2 + num_others
    return sf.HalfSpaces(
        normals=normals,
        offsets=normals @ np.array([0.1, 0.1]),
        hard=np.ones((1, size), dtype=np.bool_),
        present=np.ones((1, size), dtype=np.bool_),
        labels=np.zeros((1, size, 2), dtype=np.int64),
        sources=("corner",),
    )


def corner(weights: tuple[float, float]) -> sf.Decision:
    """The corner is nearest to (1, 2): which of the two names is which row is not said."""
    return replace(
        DECISION,
        case=np.array([2], dtype=np.int8),
        velocity=np.array([[0.1, 0.1]]),
        active=np.zeros((1, 2, 2), dtype=np.int64),
        multipliers=np.array([weights]),
        violation=np.zeros(1),
    )


@pytest.mark.parametrize("weights", [(0.9, 1.9), (1.9, 0.9)])
@pytest.mark.parametrize("num_others", [0, 1, 3, 20])
def test_whose_weight_is_whose_is_found_out(weights: tuple[float, float], num_others: int) -> None:
    wanted = np.array([[1.0, 2.0]])
    assert check_decision(alike(num_others), wanted, corner(weights), 0, 3.0, exact=False)


@pytest.mark.parametrize("weights", [(0.9, 1.7), (1.4, 1.3), (2.7, 0.0), (-0.9, 1.9), (0.9, 2.0)])
@pytest.mark.parametrize("num_others", [0, 1])
def test_weights_that_hold_nothing_are_refused_whoever_has_them(
    weights: tuple[float, float], num_others: int
) -> None:
    wanted = np.array([[1.0, 2.0]])
    assert not check_decision(alike(num_others), wanted, corner(weights), 0, 3.0, exact=False)


@pytest.mark.parametrize("size", [3, 8, 30])
def test_rows_of_one_label_in_many_dimensions_are_looked_at_in_no_time(size: int) -> None:
    # Every row touches the corner, and each is named: all ways to tell who is who would be (2 n)^n.
    normals = np.concatenate([np.eye(size), -np.eye(size)])[np.newaxis]
    rows = sf.HalfSpaces(
        normals=normals,
        offsets=np.zeros((1, 2 * size)),
        hard=np.ones((1, 2 * size), dtype=np.bool_),
        present=np.ones((1, 2 * size), dtype=np.bool_),
        labels=np.zeros((1, 2 * size, 2), dtype=np.int64),
        sources=("corner",),
    )
    claim = _Claim(np.zeros((size, 2), np.int64), np.ones(size), np.zeros(size), 0.0)
    ways = list(_on_rows(rows, 0, claim, np.ones(size)))
    assert 1 <= len(ways) <= MOST_TRIED
    assert all(way.sum() == size for way in ways)

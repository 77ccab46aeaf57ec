from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import safefilter as sf
from safefilter.decision_check import check_decision, refused

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

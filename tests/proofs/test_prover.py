"""What `prove` refuses: what is false, what is not known, what says nothing, and proofs made without it."""

from __future__ import annotations

import pytest
import z3

from proofs.prover import NotProved, Proof, prove

A, B, C = z3.Reals("a b c")
POSITIVE = {"a > 0": A > 0, "b > 0": B > 0}


def test_a_true_lemma_gives_a_proof_that_says_what_it_assumes() -> None:
    proof = prove("sum", "a + b > 0", POSITIVE, A + B > 0)
    assert proof.name == "sum"
    assert list(proof.assumptions) == ["a > 0", "b > 0"]
    # The claim, that the assumptions can be true, and each of the two left out.
    assert proof.queries == 4


def test_a_false_claim_is_refused_with_numbers_that_refute_it() -> None:
    with pytest.raises(NotProved, match="the claim is false") as caught:
        prove("wrong", "a > b", POSITIVE, A > B)
    values = {
        name: float(z3.simplify(z3.RealVal(v)).as_fraction())
        for name, v in caught.value.counter_example.items()
    }
    assert 0 < values["a"] <= values["b"]
    assert "a = " in str(caught.value)


def test_what_z3_does_not_know_is_not_proved() -> None:
    # Fermat's last theorem for cubes, on integers that are hidden among the reals: no solver here decides it.
    x, y, w = z3.Ints("x y w")
    cubes = {"positive": z3.And(x > 0, y > 0, w > 0)}
    with pytest.raises(NotProved, match="z3 does not know"):
        prove("fermat", "x^3 + y^3 != w^3", cubes, x**3 + y**3 != w**3, timeout=0.2)


def test_assumptions_that_contradict_each_other_prove_nothing() -> None:
    with pytest.raises(NotProved, match="its assumptions contradict each other"):
        prove("vacuous", "0 = 1", {"a > 0": A > 0, "a < 0": A < 0}, z3.BoolVal(False))


def test_an_assumption_that_is_not_needed_is_named() -> None:
    with pytest.raises(NotProved, match="the assumption 'c > 0' is not needed"):
        prove("sum", "a + b > 0", POSITIVE | {"c > 0": C > 0}, A + B > 0)


def test_every_alternative_is_gone_through() -> None:
    either = {"a is 1 or 2": (A == 1, A == 2)}
    assert prove("either", "0 < a < 3", either, z3.And(A > 0, A < 3)).queries == 6
    with pytest.raises(NotProved) as caught:
        prove("either", "a < 2", either, A < 2)
    assert caught.value.counter_example["a"] == "2"


def test_a_proof_can_be_used_for_other_terms() -> None:
    square = prove("square", "a >= 1 => a a >= a", {"a >= 1": A >= 1}, A * A >= A)
    used = square.at({A: B + 1})
    assert z3.is_implies(used.formula)
    proof = prove("used", "", {"b >= 0": B >= 0}, (B + 1) * (B + 1) >= B + 1, using=[used])
    assert proof.claim is not square.claim


def test_a_witness_is_checked() -> None:
    with pytest.raises(NotProved, match="'a > 0' is not needed, or its witness is none"):
        prove("sum", "a + b > 0", POSITIVE, A + B > 0, witnesses={"a > 0": {A: 1}})
    with pytest.raises(NotProved, match="witnesses for assumptions that it has not"):
        prove("sum", "a + b > 0", POSITIVE, A + B > 0, witnesses={"a > 1": {A: 1}})


def test_a_shift_must_be_one_to_one() -> None:
    with pytest.raises(NotProved, match="measured from itself"):
        prove("sum", "a + b > 0", POSITIVE, A + B > 0, shifts=[((A, -A),)])


def test_nobody_else_makes_a_proof() -> None:
    with pytest.raises(TypeError, match=r"made by prove\(...\) only"):
        Proof("forged", "0 = 1", {}, z3.BoolVal(False), 0.0, 0, object())

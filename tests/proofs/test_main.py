"""`python -m proofs` says what is not proved, and fails."""

from __future__ import annotations

import io
import runpy
from collections.abc import Callable

import pytest
import z3
from rich.console import Console

from proofs import __main__ as command_line
from proofs.own_velocity import CounterExample, counter_example
from proofs.prover import NotProved, Proof, prove

A, B = z3.Reals("a b")


def true_lemma() -> Proof:
    return prove("a_true_lemma", "a > 0 => 2 a > 0", {"a > 0": A > 0}, 2 * A > 0)


def false_lemma() -> Proof:
    return prove("a_false_lemma", "a > 0 => a > 1", {"a > 0": A > 0}, A > 1)


def unknown_lemma() -> Proof:
    x, y, w = z3.Ints("x y w")
    cubes = {"positive": z3.And(x > 0, y > 0, w > 0)}
    return prove("fermat", "x^3 + y^3 != w^3", cubes, x**3 + y**3 != w**3, timeout=0.2)


def no_counter_example() -> CounterExample:
    raise NotProved("own_velocity", "proved, though it is false")


def printed(monkeypatch: pytest.MonkeyPatch, *lemmas: Callable[[], Proof]) -> tuple[int, str]:
    monkeypatch.setattr(command_line, "FAMILIES", (lemmas,))
    console = Console(file=io.StringIO(), width=120)
    failures = command_line.main(console)
    assert isinstance(console.file, io.StringIO)
    return failures, console.file.getvalue()


def test_proved_lemmas_are_listed_with_the_counter_example_to_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    failures, text = printed(monkeypatch, true_lemma)
    assert failures == 0
    assert "a_true_lemma" in text
    assert 'v_opt="own" does not keep the promise' in text
    assert "1 lemmas proved, 0 not" in text


def test_a_false_lemma_and_an_unknown_one_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    failures, text = printed(monkeypatch, true_lemma, false_lemma, unknown_lemma)
    assert failures == 2
    assert "NOT PROVED: a_false_lemma: the claim is false" in text
    assert "a = " in text
    assert "NOT PROVED: fermat: z3 does not know" in text
    assert "1 lemmas proved, 2 not" in text


def test_a_missing_counter_example_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_line, "counter_example", no_counter_example)
    failures, text = printed(monkeypatch, true_lemma)
    assert failures == 1
    assert "NOT PROVED: own_velocity" in text


@pytest.mark.filterwarnings("ignore:.*found in sys.modules.*:RuntimeWarning")
@pytest.mark.parametrize(("lemma", "code"), [(true_lemma, 0), (false_lemma, 1)])
def test_the_command_ends_with_1_if_a_lemma_is_not_proved(
    lemma: Callable[[], Proof], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [
        name for name in vars(command_line) if hasattr(getattr(command_line, name), "LEMMAS")
    ]:
        monkeypatch.setattr(f"proofs.{name}.LEMMAS", ())
    monkeypatch.setattr("proofs.induction.LEMMAS", (lemma,))
    with pytest.raises(SystemExit) as caught:
        runpy.run_module("proofs", run_name="__main__")
    assert caught.value.code == code


def test_the_counter_example_is_confirmed_in_exact_numbers() -> None:
    found = counter_example()
    assert min(found.slack) >= 0
    assert found.distance_squared < 9
    assert 0 < found.time <= 2

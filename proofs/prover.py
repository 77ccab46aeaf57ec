"""prove(name, equation, assumptions, claim) -> Proof, or NotProved with the counter-example.

The only way to a `Proof`. z3 must answer "unsat" to every part of the claim; "unknown" and a time-out fail. A lemma
must also say something: its assumptions can all be true together, and without any one of them the claim is false
somewhere.

A proved lemma is true of all real numbers, so `Proof.at` may put any terms in the place of its variables; that is how
lemmas are put together.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter
from typing import TypeAlias

import z3

from proofs.solver import (
    PATIENCE_SECONDS,
    TIMEOUT_SECONDS,
    Shift,
    find,
    is_origin,
    parts_of,
    refute,
)

# One formula; or alternatives, one of which is true (the ways through a function): each is gone through alone.
Assumption: TypeAlias = z3.BoolRef | Sequence[z3.BoolRef]
Assumptions: TypeAlias = Mapping[str, Assumption]
Values: TypeAlias = dict[z3.ArithRef, int | float | Fraction]

# A counter-example is shown with this many of its numbers.
MOST_SHOWN = 40
# Under this name are the witnesses that the assumptions can all be true together.
TOGETHER = ""


class NotProved(Exception):
    """A lemma is wrong, says nothing, or is beyond the solver.

    Attributes:
        lemma: Its name.
        reason: What failed.
        counter_example: Numbers that show it, by variable; empty if there are none.
    """

    def __init__(
        self, lemma: str, reason: str, counter_example: Mapping[str, str] | None = None
    ) -> None:
        self.lemma = lemma
        self.reason = reason
        self.counter_example = dict(counter_example or {})
        shown = itertools.islice(self.counter_example.items(), MOST_SHOWN)
        super().__init__("\n  ".join([f"{lemma}: {reason}", *(f"{k} = {v}" for k, v in shown)]))


_MADE_BY_PROVE = object()


def _refuse_forgery(made_by: object) -> None:
    if made_by is not _MADE_BY_PROVE:
        raise TypeError("proofs and facts are made by prove(...) only")


@dataclass(frozen=True, slots=True, eq=False)
class Fact:
    """A formula that is true of all real numbers, because a `Proof` says so; `Proof.at` makes it."""

    formula: z3.BoolRef
    made_by: object = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse what is not proved."""
        _refuse_forgery(self.made_by)


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """A lemma that `prove` has proved; nothing else makes one.

    Attributes:
        name: Of the lemma.
        equation: What it says, for people, and where it comes from.
        assumptions: By name; all of them are needed.
        claim: What follows.
        seconds: How long it took.
        queries: How many questions z3 answered.
    """

    name: str
    equation: str
    assumptions: Assumptions
    claim: z3.BoolRef
    seconds: float
    queries: int
    made_by: object = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse proofs that were not proved."""
        _refuse_forgery(self.made_by)

    def at(self, terms: Mapping[z3.ArithRef, z3.ArithRef] | None = None) -> Fact:
        """Say the lemma of other terms: if its assumptions are true of them, so is its claim.

        Args:
            terms: Terms by the variables of the lemma that they stand for; the others stay.
        """
        lemma = z3.Implies(z3.And(*map(as_formula, self.assumptions.values())), self.claim)
        return Fact(z3.substitute(lemma, *(terms or {}).items()), self.made_by)


@dataclass(slots=True)
class _Asking:
    """Asks z3 on behalf of one lemma, and counts."""

    lemma: str
    timeout: float
    queries: int = 0

    def derive(
        self, hypotheses: Sequence[Assumption], claim: z3.BoolRef, shifts: Sequence[Shift]
    ) -> None:
        for alternative in _alternatives(hypotheses):
            for part in parts_of(claim):
                if not self._is_refuted([*alternative, z3.Not(part)], self.timeout, shifts):
                    raise NotProved(self.lemma, f"z3 does not know, even in {self.timeout:g} s")

    def _is_refuted(
        self, formulas: Sequence[z3.BoolRef], seconds: float, shifts: Sequence[Shift]
    ) -> bool:
        """Are the formulas contradictory? No also means that z3 does not know.

        Raises:
            NotProved: If numbers make them all true.
        """
        self.queries += 1
        answer = refute(formulas, seconds, shifts)
        if answer.verdict == z3.sat:
            raise NotProved(self.lemma, "the claim is false", answer.values)
        return bool(answer.verdict == z3.unsat)

    def _is_found(self, formulas: Sequence[z3.BoolRef], seconds: float) -> bool:
        self.queries += 1
        return bool(find(formulas, seconds).verdict == z3.sat)

    def exhibit(self, hypotheses: Sequence[Assumption], values: Values, otherwise: str) -> None:
        pinned = [variable == as_term(value) for variable, value in values.items()]
        if values and self._is_found([*map(as_formula, hypotheses), *pinned], PATIENCE_SECONDS[0]):
            # Where most numbers are known, z3 sees at once which alternatives are left.
            return
        is_known = True
        for alternative in _alternatives(hypotheses):
            self.queries += 1
            answer = find([*alternative, *pinned], self.timeout)
            if answer.verdict == z3.sat:
                return
            is_known = is_known and answer.verdict == z3.unsat
        if not is_known:
            otherwise = f"z3 does not know whether {otherwise}"
        raise NotProved(self.lemma, otherwise + (", or its witness is none" if values else ""))


def prove(
    name: str,
    equation: str,
    assumptions: Assumptions,
    claim: z3.BoolRef,
    *,
    using: Sequence[Fact] = (),
    opaque: Sequence[str | z3.BoolRef] = (),
    shifts: Sequence[Shift] = (),
    witnesses: Mapping[str, Values] | None = None,
    timeout: float = TIMEOUT_SECONDS,
) -> Proof:
    """Prove a lemma, and show that it is not vacuous.

    Args:
        name: Of the lemma.
        equation: What it says, for people, and where it comes from.
        assumptions: By name.
        claim: What follows.
        using: Other lemmas that z3 may use: they are true, so they assume nothing.
        opaque: What z3 need not look into, assumptions by name or parts of formulas: it is true or not, wherever it
            occurs. That proves more than is asked for.
        shifts: Variables that z3 may find easier to measure from elsewhere, see `refute`.
        witnesses: Numbers that help z3 to show that an assumption is needed, by its name, or, under `TOGETHER`, that
            all can be true together. They are checked, and what they leave open z3 finds.
        timeout: Most seconds for one attempt at one question.

    Raises:
        NotProved: If it is false (with the counter-example), vacuous, or assumes what it does not need; if z3 does not
            know.
    """
    began, asking, numbers = perf_counter(), _Asking(name, timeout), dict(witnesses or {})
    if unknown := set(numbers) - {TOGETHER, *assumptions}:
        raise NotProved(name, f"witnesses for assumptions that it has not: {sorted(unknown)}")
    if not all(map(is_origin, shifts)):
        raise NotProved(name, "a variable is measured from itself")
    named = [key for key in opaque if isinstance(key, str)]
    hidden = [(as_formula(assumptions[key]), z3.Bool(key)) for key in named]
    hidden += [(part, z3.Bool(part.sexpr())) for part in opaque if not isinstance(part, str)]
    shown = [_substituted(fact, hidden) for key, fact in assumptions.items() if key not in named]
    facts = [z3.substitute(fact.formula, *hidden) for fact in using]
    bits = [z3.Bool(key) for key in named]
    asking.derive([*shown, *bits, *facts], z3.substitute(claim, *hidden), shifts)
    asking.exhibit(
        list(assumptions.values()),
        numbers.get(TOGETHER, {}),
        "its assumptions contradict each other",
    )
    for dropped in assumptions:
        kept = [fact for other, fact in assumptions.items() if other != dropped]
        asking.exhibit(
            [*kept, z3.Not(claim)],
            numbers.get(dropped, {}),
            f"the assumption {dropped!r} is not needed",
        )
    return Proof(
        name, equation, assumptions, claim, perf_counter() - began, asking.queries, _MADE_BY_PROVE
    )


def as_formula(assumption: Assumption) -> z3.BoolRef:
    """One formula for an assumption, alternatives joined by "or"."""
    return z3.Or(*assumption) if isinstance(assumption, Sequence) else assumption


def _substituted(
    assumption: Assumption, terms: Sequence[tuple[z3.BoolRef, z3.BoolRef]]
) -> Assumption:
    if isinstance(assumption, Sequence):
        return [z3.substitute(formula, *terms) for formula in assumption]
    return z3.substitute(assumption, *terms)


def as_term(value: float | Fraction) -> z3.ArithRef:
    """Z3 number; a float stands for the exact value of its bits."""
    return z3.RealVal(Fraction(value))


def _alternatives(hypotheses: Sequence[Assumption]) -> Iterator[list[z3.BoolRef]]:
    choices: list[Sequence[z3.BoolRef]] = [
        fact if isinstance(fact, Sequence) else (fact,) for fact in hypotheses
    ]
    for choice in itertools.product(*choices):
        yield list(choice)

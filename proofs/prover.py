"""prove(lemma) -> Proof, or NotProved with the counter-example.

The only way to a `Proof`. z3 has to answer "unsat" for every step; "unknown" and a time-out fail. A lemma must also say
something: its assumptions can be true together, and without any one of them the claim is false somewhere.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter
from types import MappingProxyType

import z3
from z3.z3util import get_vars

# Per question. Hardly any takes a second; beyond this a lemma wants better steps, not more time.
TIMEOUT_SECONDS = 60.0
# A question is put to every solver for a moment, then for longer: most are easy for one of them, and hard for others.
PATIENCE_SECONDS = (0.1, 1.0, 10.0)
SOLVERS: tuple[Callable[[], z3.Solver], ...] = (
    z3.Solver,
    lambda: z3.Then("simplify", "propagate-values", "solve-eqs", "smt").solver(),
)
# A counter-example is shown with this many of its numbers.
MOST_SHOWN = 40

Facts = dict[str, z3.BoolRef]
Values = Mapping[z3.ArithRef, int | Fraction]


class NotProved(Exception):
    """A lemma is wrong, says nothing, or is beyond the solver.

    Attributes:
        lemma: Its name.
        reason: What failed.
        counter_example: Numbers that show it, as text; empty if there are none.
    """

    def __init__(self, lemma: str, reason: str, counter_example: str = "") -> None:
        shown = f"\n{counter_example}" if counter_example else ""
        super().__init__(f"{lemma}: {reason}{shown}")
        self.lemma = lemma
        self.reason = reason
        self.counter_example = counter_example


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Something that is proved from what is known so far, and known from then on.

    Attributes:
        claim: What is claimed.
        using: Names of the facts that it is proved from; None: all. Fewer facts are quicker, never weaker.
        split: Names of facts that are alternatives ("or"): each is gone through alone.
    """

    claim: z3.BoolRef
    using: tuple[str, ...] | None = None
    split: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """The claim of another lemma, for other terms; its assumptions are proved from what is known so far.

    Attributes:
        proof: Proof of that lemma.
        at: Terms that stand for its variables.
        using: As in `Step`, for its assumptions.
    """

    proof: Proof
    at: Mapping[z3.ArithRef, z3.ArithRef]
    using: tuple[str, ...] | None = None

    def of(self, formula: z3.BoolRef) -> z3.BoolRef:
        """Write a formula of that lemma in the terms of this one."""
        return z3.substitute(formula, *self.at.items())


@dataclass(frozen=True, slots=True, eq=False)
class Lemma:
    """A claim about all real numbers.

    Attributes:
        name: Of the lemma.
        equation: What it says, for people.
        assumptions: By name; all are needed.
        claim: What follows.
        definitions: Facts that cost nothing: of square roots and quotients, true of some number for all arguments.
        steps: What is proved on the way, by name.
        using: As in `Step`, for the claim itself.
        split: As in `Step`, for the claim itself.
        shift: Variables that z3 finds easier to measure from elsewhere: v becomes v' + shift in the proof of the claim.
        witnesses: Numbers that help z3 to show that an assumption is needed, by its name, or, under "", that all can be
            true together. They are checked; what they leave open z3 finds.
    """

    name: str
    equation: str
    assumptions: Mapping[str, z3.BoolRef]
    claim: z3.BoolRef
    definitions: tuple[z3.BoolRef, ...] = ()
    steps: Mapping[str, Step | Instance] = field(default_factory=dict)
    using: tuple[str, ...] | None = None
    split: tuple[str, ...] = ()
    shift: Mapping[z3.ArithRef, z3.ArithRef] = field(default_factory=dict)
    witnesses: Mapping[str, Values] = field(default_factory=dict)


_MADE_BY_PROVE = object()


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """A lemma that `prove` has proved; nothing else makes one.

    Attributes:
        lemma: What is proved.
        seconds: How long it took.
        queries: How many questions z3 answered.
    """

    lemma: Lemma
    seconds: float
    queries: int
    made_by: object = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse proofs that were not proved.

        Raises:
            TypeError: If this is not called by `prove`.
        """
        if self.made_by is not _MADE_BY_PROVE:
            raise TypeError("a Proof is made by prove(lemma) only")


def prove(lemma: Lemma, timeout: float = TIMEOUT_SECONDS) -> Proof:
    """Prove a lemma and show that it is not vacuous.

    Args:
        lemma: The lemma.
        timeout: Seconds that each query may take.

    Raises:
        NotProved: If it is false (with the counter-example), vacuous, or has an assumption that is not needed; if z3
            does not know; if a witness is none.
    """
    began = perf_counter()
    asking = _Asking(lemma.name, timeout)
    facts: Facts = dict(lemma.assumptions)
    facts |= {f"definition {k}": fact for k, fact in enumerate(lemma.definitions)}
    for name, step in lemma.steps.items():
        facts[name] = asking.known(name, step, facts)
    asking.derive("the claim", Step(lemma.claim, lemma.using, lemma.split), facts, lemma.shift)
    asking.not_vacuous(lemma)
    return Proof(lemma, perf_counter() - began, asking.queries, _MADE_BY_PROVE)


@dataclass(slots=True)
class _Asking:
    """Asks z3 on behalf of one lemma, and counts."""

    lemma: str
    timeout: float
    queries: int = 0

    def known(self, name: str, step: Step | Instance, facts: Facts) -> z3.BoolRef:
        if isinstance(step, Step):
            return self.derive(name, step, facts)
        other = step.proof.lemma
        needed = dict(other.assumptions)
        needed |= {f"definition {k}": fact for k, fact in enumerate(other.definitions)}
        for assumption, formula in needed.items():
            goal = Step(step.of(formula), step.using)
            self.derive(f"{name}, {assumption!r} of {other.name}", goal, facts)
        return step.of(other.claim)

    def derive(
        self,
        name: str,
        step: Step,
        facts: Facts,
        shift: Mapping[z3.ArithRef, z3.ArithRef] = MappingProxyType({}),
    ) -> z3.BoolRef:
        chosen = facts if step.using is None else {key: facts[key] for key in step.using}
        if any(fact.eq(step.claim) for fact in chosen.values()):
            return step.claim
        context = [_shifted(fact, shift) for key, fact in chosen.items() if key not in step.split]
        signs = [fact for fact in context if len(get_vars(fact)) <= 1]
        alternatives = [
            [_shifted(way, shift) for way in _alternatives(chosen[key])] for key in step.split
        ]
        denials = [_shifted(z3.Not(goal), shift) for goal in _parts(step.claim)]
        for case in itertools.product(*alternatives):
            for denied in denials:
                outcome, model = self.ask([*context, *case, denied], [*signs, *case, denied])
                if outcome != z3.unsat:
                    reason = f"z3 does not know whether {name} holds"
                    if outcome == z3.sat:
                        reason = f"{name} does not follow"
                    raise NotProved(self.lemma, reason, model)
        return step.claim

    def not_vacuous(self, lemma: Lemma) -> None:
        if missing := set(lemma.witnesses) - {"", *lemma.assumptions}:
            raise NotProved(lemma.name, f"witnesses for unknown assumptions: {sorted(missing)}")
        everything = [*lemma.assumptions.values(), *lemma.definitions]
        self.exhibit(everything, lemma.witnesses.get(""), "its assumptions contradict each other")
        for name, assumption in lemma.assumptions.items():
            others = [fact for fact in everything if fact is not assumption]
            self.exhibit(
                [*others, z3.Not(lemma.claim)],
                lemma.witnesses.get(name),
                f"the assumption {name!r} is not needed",
            )

    def exhibit(self, formulas: list[z3.BoolRef], values: Values | None, otherwise: str) -> None:
        """Find numbers that make all formulas true.

        Raises:
            NotProved: If there are none, or z3 finds none.
        """
        pinned = [variable == z3.RealVal(value) for variable, value in (values or {}).items()]
        outcome, _ = self.ask([*formulas, *pinned])
        if outcome == z3.unknown:
            otherwise = f"z3 does not know whether {otherwise}"
        if outcome != z3.sat:
            raise NotProved(self.lemma, otherwise + (", or its witness is none" if values else ""))

    def ask(
        self, formulas: list[z3.BoolRef], core: list[z3.BoolRef] | None = None
    ) -> tuple[z3.CheckSatResult, str]:
        """Can all formulas be true? An example is evaluated before it is believed.

        Args:
            formulas: What is to be true.
            core: Some of them. If these contradict each other, all do; that is often quicker to see.
        """
        self.queries += 1
        for seconds in (*PATIENCE_SECONDS, self.timeout):
            for asked, make in itertools.product((core, formulas), SOLVERS):
                if asked is None:
                    continue
                solver = make()
                solver.set("timeout", int(1000 * min(seconds, self.timeout)))
                solver.add(*asked)
                outcome = solver.check()
                if outcome == z3.unsat:
                    return outcome, ""
                if outcome == z3.sat and asked is formulas and _is_model(solver.model(), formulas):
                    return outcome, _text(solver.model())
        return z3.unknown, ""


def _is_model(model: z3.ModelRef, formulas: list[z3.BoolRef]) -> bool:
    return all(z3.is_true(model.eval(formula, model_completion=True)) for formula in formulas)


def _shifted(formula: z3.BoolRef, shift: Mapping[z3.ArithRef, z3.ArithRef]) -> z3.BoolRef:
    """Write v' + shift for v, which says the same of all numbers: v' = v - shift is one, too."""
    if not shift:
        return formula
    moved = [(variable, z3.Real(f"{variable}'") + by) for variable, by in shift.items()]
    return z3.simplify(z3.substitute(formula, *moved))


def _alternatives(fact: z3.BoolRef) -> list[z3.BoolRef]:
    return list(fact.children()) if z3.is_or(fact) else [fact]


def _parts(claim: z3.BoolRef) -> list[z3.BoolRef]:
    return [part for child in claim.children() for part in _parts(child)] if z3.is_and(claim) else [claim]


def _text(model: z3.ModelRef) -> str:
    names = sorted(str(variable) for variable in model.decls())
    by_name = {str(variable): model[variable] for variable in model.decls()}
    return "\n".join(f"  {name} = {_number(by_name[name])}" for name in names[:MOST_SHOWN])


def _number(value: z3.ExprRef) -> str:
    if z3.is_algebraic_value(value):
        return f"{value.as_decimal(12)} (algebraic)"
    return str(value)

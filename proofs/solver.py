"""One question to z3: can these formulas all be true? To a portfolio, because most are easy for some solver only.

``unsat`` is believed. ``sat`` is believed only after the numbers have been put into every formula.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import z3

# Per attempt. Hardly any question takes a second; beyond this a lemma wants to be cut into smaller ones, not more time.
TIMEOUT_SECONDS = 40.0
# Every solver gets a moment first, then longer.
PATIENCE_SECONDS = (0.5, 4.0)
SOLVERS: tuple[Callable[[], z3.Solver], ...] = (
    z3.Solver,
    lambda: z3.Then("simplify", "propagate-values", "solve-eqs", "qfnra-nlsat").solver(),
)
# Comparisons of more terms are left out in a first attempt: fewer facts are quicker, and prove no more.
LONG_COMPARISON = 30
COMPARISONS = {z3.Z3_OP_LE, z3.Z3_OP_GE, z3.Z3_OP_LT, z3.Z3_OP_GT}
# Digits that irrational numbers of a counter-example are shown with.
DIGITS = 12

# Variables to be measured from elsewhere, one after the other: v written as v + by.
Shift = Sequence[tuple[z3.ArithRef, z3.ArithRef]]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What z3 said.

    Attributes:
        verdict: ``z3.sat``, ``z3.unsat`` or ``z3.unknown``.
        values: If ``sat``, numbers that make all formulas true, by variable.
    """

    verdict: z3.CheckSatResult
    values: Mapping[str, str]


def refute(
    formulas: Sequence[z3.BoolRef],
    timeout: float = TIMEOUT_SECONDS,
    shifts: Sequence[Shift] = (),
) -> Answer:
    """Can all formulas be true, where ``unsat`` is hoped for? The last is what is to be refuted.

    Args:
        formulas: What is to be true.
        timeout: Most seconds for one attempt.
        shifts: Variables that may be measured from elsewhere, each a change to try. It is one to one, so the question
            is the same, and often easier.
    """
    facts = [part for formula in formulas for part in parts_of(formula)]
    is_chosen = _seem_to_matter(facts)
    questions = []
    for shift in (*shifts, ()):
        given = _written(facts, shift)
        questions.append(given)
        if not all(is_chosen):
            questions.insert(-1, list(itertools.compress(given, is_chosen)))
    return _ask(questions, given, timeout)


def find(formulas: Sequence[z3.BoolRef], timeout: float = TIMEOUT_SECONDS) -> Answer:
    """Can all formulas be true, where ``sat`` is hoped for?"""
    given = _written([part for formula in formulas for part in parts_of(formula)], ())
    return _ask([given], given, timeout)


def parts_of(formula: z3.BoolRef) -> Iterator[z3.BoolRef]:
    """The formulas that "and" joins."""
    if z3.is_and(formula):
        for part in formula.children():
            yield from parts_of(part)
    else:
        yield formula


def _ask(
    questions: Sequence[Sequence[z3.BoolRef]], given: Sequence[z3.BoolRef], timeout: float
) -> Answer:
    patience = [seconds for seconds in PATIENCE_SECONDS if seconds < timeout]
    for seconds, facts, make in itertools.product([*patience, timeout], questions, SOLVERS):
        solver = make()
        solver.set("timeout", int(1000 * seconds))
        solver.add(*facts)
        verdict = solver.check()
        if verdict == z3.unsat:
            return Answer(verdict, {})
        if verdict == z3.sat and facts is given and _is_model(solver.model(), given):
            return Answer(verdict, _readable(solver.model()))
    return Answer(z3.unknown, {})


def _written(facts: Sequence[z3.BoolRef], shift: Shift) -> list[z3.BoolRef]:
    for variable, by in shift:
        facts = [z3.substitute(fact, (variable, variable + by)) for fact in facts]
    return [z3.simplify(fact, som=True) for fact in facts]


def _seem_to_matter(facts: Sequence[z3.BoolRef]) -> list[bool]:
    """Which facts seem to matter for the last one?

    Not long comparisons, nor values of variables that are not asked for, nor definitions of roots and quotients that
    nothing asked for is made of. (Those are variables named by their arguments, in parentheses.)
    """
    names = [set(variables_of(fact)) for fact in facts]
    derived = [{name for name in mine if "(" in name} for mine in names]
    is_chosen = [_is_value(fact) and str(fact.arg(0)) in names[-1] for fact in facts]
    is_chosen[-1] = True
    pool = [k for k, fact in enumerate(facts[:-1]) if not (_is_value(fact) or _is_long(fact))]
    reached: set[str] = set().union(*itertools.compress(derived, is_chosen))
    while True:
        for k in pool:
            is_chosen[k] = not derived[k] or bool(derived[k] & reached)
        grown = reached.union(*itertools.compress(derived, is_chosen))
        if grown == reached:
            break
        reached = grown
    return is_chosen


def variables_of(fact: z3.ExprRef) -> dict[str, z3.ExprRef]:
    """Variables in a formula, by name; z3's own `get_vars` visits shared terms again and again."""
    found, seen, pending = dict[str, z3.ExprRef](), set[int](), [fact]
    while pending:
        term = pending.pop()
        if term.get_id() in seen:
            continue
        seen.add(term.get_id())
        if z3.is_const(term) and term.decl().kind() == z3.Z3_OP_UNINTERPRETED:
            found[str(term)] = term
        pending.extend(term.children())
    return found


def _is_value(fact: z3.BoolRef) -> bool:
    return bool(z3.is_eq(fact) and z3.is_const(fact.arg(0)))


def _is_long(fact: z3.BoolRef) -> bool:
    inner = fact.arg(0) if z3.is_not(fact) else fact
    return inner.decl().kind() in COMPARISONS and _size(inner) > LONG_COMPARISON


def _size(term: z3.ExprRef) -> int:
    return 1 + sum(map(_size, term.children()))


def _is_model(model: z3.ModelRef, formulas: Sequence[z3.BoolRef]) -> bool:
    return all(z3.is_true(model.eval(formula, model_completion=True)) for formula in formulas)


def _readable(model: z3.ModelRef) -> dict[str, str]:
    values = {}
    for name in sorted(model.decls(), key=str):
        value = model[name]
        if z3.is_algebraic_value(value):
            values[str(name)] = value.as_decimal(DIGITS)
        elif name.arity() == 0:
            values[str(name)] = str(value)
    return values


def is_origin(shift: Shift) -> bool:
    """Is no variable measured from itself? Only then is each move one to one."""
    return not any(str(variable) in variables_of(by) for variable, by in shift)

"""Run the shipped Python code on real numbers that are not known yet, and collect every way it can take.

A `Number` stands for a z3 term of the reals. Arithmetic on it builds terms; a comparison makes a `Condition`, and as
soon as the code asks whether it is true (``if``, ``and``, ``max``), the run takes one side and the other side is run
later. So `paths` sees all that the function can do, without a second copy of it:

* a division is an obligation: the divisor is not zero;
* a square root is a new variable s, an obligation x >= 0, and the definition s >= 0, s * s = x if x >= 0.

Numbers are exact: nothing here speaks of rounding.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from fractions import Fraction
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, Generic, ParamSpec, TypeVar, cast

import z3

from safefilter.jit import source_of

P = ParamSpec("P")
T = TypeVar("T")
Exact = int | float | Fraction

# Far more ways than any formula here has: beyond it, the code loops on unknown numbers.
MAX_PATHS = 2000


def term_of(value: object) -> z3.ArithRef:
    """Z3 term of a number; a float stands for the exact value of its bits.

    Raises:
        TypeError: If it is no number.
    """
    if isinstance(value, Number):
        return value.term
    if isinstance(value, int | float | Fraction) and not isinstance(value, bool):
        return z3.RealVal(Fraction(value))
    raise TypeError(f"expected a number, got {type(value).__name__}")


def canonical(term: z3.ExprRef) -> z3.ExprRef:
    """Write equal polynomials alike, so that the same question is asked once."""
    return z3.simplify(term, som=True, arith_lhs=True, sort_sums=True)


class Number:
    """A real number, known only as a z3 term; it behaves as a float does in formulas."""

    __slots__ = ("term",)
    __hash__ = None  # type: ignore[assignment]  # equality of unknown numbers is a question, not a key

    def __init__(self, term: z3.ArithRef) -> None:
        self.term = term

    def __add__(self, other: Number | Exact) -> Number:
        return Number(self.term + term_of(other))

    def __radd__(self, other: Exact) -> Number:
        return Number(term_of(other) + self.term)

    def __sub__(self, other: Number | Exact) -> Number:
        return Number(self.term - term_of(other))

    def __rsub__(self, other: Exact) -> Number:
        return Number(term_of(other) - self.term)

    def __mul__(self, other: Number | Exact) -> Number:
        return Number(self.term * term_of(other))

    def __rmul__(self, other: Exact) -> Number:
        return Number(term_of(other) * self.term)

    def __truediv__(self, other: Number | Exact) -> Number:
        divisor = term_of(other)
        _run().obligations.append(divisor != 0)
        return Number(self.term / divisor)

    def __rtruediv__(self, other: Exact) -> Number:
        return Number(term_of(other)) / self

    def __neg__(self) -> Number:
        return Number(-self.term)

    def __abs__(self) -> Number:
        return self if self >= 0 else -self

    def __lt__(self, other: Number | Exact) -> Condition:
        return Condition(self.term < term_of(other))

    def __le__(self, other: Number | Exact) -> Condition:
        return Condition(self.term <= term_of(other))

    def __gt__(self, other: Number | Exact) -> Condition:
        return Condition(self.term > term_of(other))

    def __ge__(self, other: Number | Exact) -> Condition:
        return Condition(self.term >= term_of(other))

    def __eq__(self, other: object) -> Condition:  # type: ignore[override]  # the answer is not known yet
        return Condition(self.term == term_of(other))

    def __ne__(self, other: object) -> Condition:  # type: ignore[override]
        return Condition(self.term != term_of(other))


class Condition:
    """A comparison of numbers; asked for its truth, it takes the side that this run is on."""

    __slots__ = ("term",)

    def __init__(self, term: z3.BoolRef) -> None:
        self.term = term

    def __bool__(self) -> bool:
        return _run().decide(self.term)


@dataclass(slots=True)
class _Run:
    """One way through the code: ``prefix`` says which side to take at the first questions."""

    prefix: tuple[bool, ...]
    taken: list[bool] = field(default_factory=list)
    conditions: list[z3.BoolRef] = field(default_factory=list)
    definitions: dict[str, z3.BoolRef] = field(default_factory=dict)
    obligations: list[z3.BoolRef] = field(default_factory=list)
    answers: dict[str, bool] = field(default_factory=dict)

    def decide(self, condition: z3.BoolRef) -> bool:
        question = canonical(condition)
        if z3.is_true(question) or z3.is_false(question):
            return bool(z3.is_true(question))
        key = question.sexpr()
        if key not in self.answers:
            place = len(self.taken)
            answer = self.prefix[place] if place < len(self.prefix) else True
            self.taken.append(answer)
            self.conditions.append(condition if answer else z3.Not(condition))
            self.answers[key] = answer
            self.answers[canonical(z3.Not(question)).sexpr()] = not answer
        return self.answers[key]

    def root(self, square: z3.ArithRef) -> z3.ArithRef:
        self.obligations.append(square >= 0)
        name = f"sqrt({canonical(square).sexpr()})"
        root = z3.Real(name)
        self.definitions[name] = z3.Implies(square >= 0, z3.And(root >= 0, root * root == square))
        return root


_current: ContextVar[_Run] = ContextVar("_current")


def _run() -> _Run:
    try:
        return _current.get()
    except LookupError:
        raise RuntimeError("unknown numbers are divided and compared inside `paths` only") from None


def _sqrt(value: Number | Exact) -> Number:
    return Number(_run().root(term_of(value)))


def _isfinite(value: object) -> bool:
    term_of(value)
    return True


# What formulas use of `math`; anything else fails by name.
SYMBOLIC_MATH = SimpleNamespace(
    sqrt=_sqrt, isfinite=_isfinite, fabs=abs, pi=math.pi, inf=math.inf, nan=math.nan
)


def symbolic(function: Callable[P, T]) -> Callable[P, T]:
    """Rebuild a shipped function from its own byte code, so that it runs on numbers that are not known.

    The functions that it calls are rebuilt alike, and `math` is replaced; nothing else changes.
    """
    source = cast("FunctionType", source_of(function))
    names = dict(source.__globals__)
    for name in _names(source.__code__):
        value = names.get(name)
        if value is math:
            names[name] = SYMBOLIC_MATH
        elif isinstance(source_of(cast("Any", value)), FunctionType):
            names[name] = symbolic(cast("Callable[..., object]", value))
    rebuilt = FunctionType(
        source.__code__, names, source.__name__, source.__defaults__, source.__closure__
    )
    rebuilt.__kwdefaults__ = source.__kwdefaults__
    return cast("Callable[P, T]", rebuilt)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


@dataclass(frozen=True, slots=True, eq=False)
class Path(Generic[T]):
    """One way through a function.

    Attributes:
        conditions: What is true of the arguments on this way.
        definitions: What the square roots of this way are.
        obligations: What must be true for the formula to mean anything: divisors and squares.
        result: What the function returned.
    """

    conditions: tuple[z3.BoolRef, ...]
    definitions: tuple[z3.BoolRef, ...]
    obligations: tuple[z3.BoolRef, ...]
    result: T

    @property
    def taken(self) -> z3.BoolRef:
        """All conditions and definitions as one term."""
        return z3.And(*self.conditions, *self.definitions)

    @property
    def is_defined(self) -> z3.BoolRef:
        """All obligations as one term."""
        return z3.And(*self.obligations)


def paths(function: Callable[[], T]) -> list[Path[T]]:
    """Run ``function`` once for every way through it.

    Args:
        function: Calls `symbolic` functions on `Number`; anything it writes to it must make itself.

    Returns:
        Ways whose conditions exclude each other and leave nothing out.

    Raises:
        RecursionError: If there are more than `MAX_PATHS`.
    """
    found: list[Path[T]] = []
    pending: list[tuple[bool, ...]] = [()]
    while pending:
        if len(found) == MAX_PATHS:
            raise RecursionError(f"more than {MAX_PATHS} ways through {function}")
        run = _Run(pending.pop())
        with _running(run):
            result = function()
        found.append(
            Path(
                tuple(run.conditions), tuple(run.definitions.values()), tuple(run.obligations), result
            )
        )
        for place in range(len(run.prefix), len(run.taken)):
            pending.append((*run.taken[:place], not run.taken[place]))
    return found


@contextlib.contextmanager
def _running(run: _Run) -> Iterator[None]:
    token = _current.set(run)
    try:
        yield
    finally:
        _current.reset(token)

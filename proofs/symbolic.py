"""Run the shipped Python code on real numbers that are not known yet, and collect every way it can take.

A `Number` stands for a z3 term of the reals. Arithmetic on it builds terms; a comparison makes a `Condition`, and as
soon as the code asks whether it is true (``if``, ``and``, ``max``), the run takes one side and the other side is run
later. So `paths` sees all that the function can do, without a second copy of it:

* a division multiplies with a new variable z, under the obligation y != 0 and the definition z * y = 1 if y != 0;
* a square root is a new variable s, under the obligation x >= 0 and the definition s >= 0, s * s = x if x >= 0.

All terms are polynomials, then, and each question asks for the sign of one. Equal polynomials are written alike, so
what two robots compute of one pair is asked once.

Numbers are exact: nothing here speaks of rounding.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
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

# Longer arguments are numbered, so that counter-examples can be read.
LONGEST_NAME = 30
_numbers: dict[str, int] = {}

NEGATIVE, NOT_POSITIVE = frozenset({-1}), frozenset({-1, 0})
POSITIVE, NOT_NEGATIVE = frozenset({1}), frozenset({0, 1})
ZERO, NOT_ZERO = frozenset({0}), frozenset({-1, 1})
ANY_SIGN = frozenset({-1, 0, 1})


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


def canonical(term: z3.ArithRef) -> z3.ArithRef:
    """Write equal polynomials alike."""
    return z3.simplify(term, som=True, sort_sums=True)


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
        return Number(self.term * _run().inverse(term_of(other)))

    def __rtruediv__(self, other: Exact) -> Number:
        return Number(term_of(other)) / self

    def __neg__(self) -> Number:
        return Number(-self.term)

    def __abs__(self) -> Number:
        return self if self >= 0 else -self

    def __lt__(self, other: Number | Exact) -> Condition:
        return Condition(self.term - term_of(other), NEGATIVE)

    def __le__(self, other: Number | Exact) -> Condition:
        return Condition(self.term - term_of(other), NOT_POSITIVE)

    def __gt__(self, other: Number | Exact) -> Condition:
        return Condition(self.term - term_of(other), POSITIVE)

    def __ge__(self, other: Number | Exact) -> Condition:
        return Condition(self.term - term_of(other), NOT_NEGATIVE)

    def __eq__(self, other: object) -> Condition:  # type: ignore[override]  # the answer is not known yet
        return Condition(self.term - term_of(other), ZERO)

    def __ne__(self, other: object) -> Condition:  # type: ignore[override]
        return Condition(self.term - term_of(other), NOT_ZERO)


class Condition:
    """A question for the sign of a number; asked for its truth, it takes the side that this run is on."""

    __slots__ = ("signs", "term")

    def __init__(self, term: z3.ArithRef, signs: frozenset[int]) -> None:
        self.term = term
        self.signs = signs

    def __bool__(self) -> bool:
        return _run().decide(self.term, self.signs)


@dataclass(slots=True)
class _Run:
    """One way through the code: ``prefix`` says which side to take at the first questions."""

    prefix: tuple[bool, ...]
    taken: list[bool] = field(default_factory=list)
    conditions: list[z3.BoolRef] = field(default_factory=list)
    definitions: dict[str, z3.BoolRef] = field(default_factory=dict)
    obligations: list[z3.BoolRef] = field(default_factory=list)
    signs: dict[str, frozenset[int]] = field(default_factory=dict)

    def decide(self, term: z3.ArithRef, signs: frozenset[int]) -> bool:
        """Is the sign of ``term`` among ``signs``? Ask what is known, then the prefix, then say yes."""
        polynomial = canonical(term)
        if z3.is_rational_value(polynomial):
            value = polynomial.as_fraction()
            return (value > 0) - (value < 0) in signs
        mirrored = canonical(-term)
        if mirrored.sexpr() < polynomial.sexpr():
            term, polynomial, signs = -term, mirrored, frozenset(-sign for sign in signs)
        key = polynomial.sexpr()
        known = self.signs.get(key, ANY_SIGN)
        if known <= signs or not known & signs:
            return known <= signs
        place = len(self.taken)
        answer = self.prefix[place] if place < len(self.prefix) else True
        self.taken.append(answer)
        self.signs[key] = known & signs if answer else known - signs
        self.conditions.append(_has_sign(z3.simplify(term), signs if answer else ANY_SIGN - signs))
        return answer

    def root(self, square: z3.ArithRef) -> z3.ArithRef:
        square, root = z3.simplify(square), root_of(square)
        self.obligations.append(square >= 0)
        self.definitions[str(root)] = z3.Implies(
            square >= 0, z3.And(root >= 0, root * root == square)
        )
        return root

    def inverse(self, divisor: z3.ArithRef) -> z3.ArithRef:
        divisor, inverse = z3.simplify(divisor), inverse_of(divisor)
        self.obligations.append(divisor != 0)
        self.definitions[str(inverse)] = z3.Implies(divisor != 0, inverse * divisor == 1)
        return inverse


def root_of(square: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for a square root."""
    return z3.Real(_name("sqrt", square))


def inverse_of(divisor: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for one over a divisor."""
    return z3.Real(_name("1/", divisor))


def _name(function: str, argument: z3.ArithRef) -> str:
    """Name of a function's value: equal polynomials have one, others never."""
    text = canonical(argument).sexpr()
    if len(text) <= LONGEST_NAME:
        return f"{function}({text})"
    return f"{function}(#{_numbers.setdefault(text, len(_numbers))})"


def _has_sign(polynomial: z3.ArithRef, signs: frozenset[int]) -> z3.BoolRef:
    return {
        NEGATIVE: polynomial < 0,
        NOT_POSITIVE: polynomial <= 0,
        POSITIVE: polynomial > 0,
        NOT_NEGATIVE: polynomial >= 0,
        ZERO: polynomial == 0,
        NOT_ZERO: polynomial != 0,
    }[signs]


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


def symbolic(
    function: Callable[P, T], summaries: Mapping[str, Callable[..., object]] | None = None
) -> Callable[P, T]:
    """Rebuild a shipped function from its own byte code, so that it runs on numbers that are not known.

    The functions that it calls are rebuilt alike, and `math` is replaced; nothing else changes.

    Args:
        function: A formula, compiled or not.
        summaries: Stand-ins for functions that it calls, by name: what another lemma says of them.
    """
    source = cast("FunctionType", source_of(function))
    names = dict(source.__globals__)
    for name in _names(source.__code__):
        value = names.get(name)
        if summaries and name in summaries:
            names[name] = summaries[name]
        elif value is math:
            names[name] = SYMBOLIC_MATH
        elif isinstance(source_of(cast("Any", value)), FunctionType):
            names[name] = symbolic(cast("Callable[..., object]", value), summaries)
    rebuilt = FunctionType(
        source.__code__, names, source.__name__, source.__defaults__, source.__closure__
    )
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
        new = range(len(run.prefix), len(run.taken))
        pending.extend((*run.taken[:place], not run.taken[place]) for place in new)
    return found


def only_path(function: Callable[[], T]) -> Path[T]:
    """The one way through a formula without branches.

    Raises:
        ValueError: If there are more.
    """
    found = paths(function)
    if len(found) != 1:
        raise ValueError(f"expected a formula without branches, found {len(found)} ways through it")
    return found[0]


def is_total(ways: Sequence[Path[Any]]) -> z3.BoolRef:
    """Some way is always taken, and its formulas are defined."""
    covered = z3.Or(*(z3.And(*way.conditions) for way in ways))
    return z3.And(covered, *(z3.Implies(way.taken, way.is_defined) for way in ways))


def graph(ways: Sequence[Path[tuple[Number, ...]]], values: Sequence[z3.ArithRef]) -> z3.BoolRef:
    """The values are what the function returns: one alternative for every way through it."""
    return z3.Or(
        *(
            z3.And(
                way.taken,
                *(value == term_of(r) for value, r in zip(values, way.result, strict=True)),
            )
            for way in ways
        )
    )


@contextlib.contextmanager
def _running(run: _Run) -> Iterator[None]:
    token = _current.set(run)
    try:
        yield
    finally:
        _current.reset(token)

"""Run the shipped Python code on real numbers that are not known yet, and collect every way it can take.

A `Number` stands for a z3 term of the reals. Arithmetic on it builds terms; as soon as the code asks whether a
comparison is true (``if``, ``and``, ``max``), the run takes one side, and the other side is run later. So `paths` sees
all that the function can do, and there is no second copy of it:

* a division multiplies with a variable z, under the obligation y != 0, and z * y = 1 if y != 0;
* a square root is a variable s, under the obligation x >= 0, with s >= 0 and s * s = x if x >= 0;
* a sine and a cosine of one angle are two variables with s^2 + c^2 = 1; a proof states what else it uses of them.

All terms are polynomials, then. Equal polynomials are written alike, so what two robots compute of one pair is one
variable, and asked once. Numbers are exact: nothing here speaks of rounding.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from fractions import Fraction
from types import FunctionType, SimpleNamespace
from typing import Any, ParamSpec, TypeVar, cast

import z3

from proofs.terms import canonical, cosine_of, inverse_of, root_of, sine_of
from safefilter.jit import source_of

P = ParamSpec("P")
T = TypeVar("T")
Exact = int | float | Fraction

# Far more ways than any formula here has: beyond it, the code loops on unknown numbers.
MAX_PATHS = 5000

NEGATIVE, NOT_POSITIVE = frozenset({-1}), frozenset({-1, 0})
POSITIVE, NOT_NEGATIVE = frozenset({1}), frozenset({0, 1})
ZERO, NOT_ZERO = frozenset({0}), frozenset({-1, 1})
ANY_SIGN = frozenset({-1, 0, 1})


def term_of(value: object) -> z3.ArithRef:
    """Z3 term of a number; a float stands for the exact value of its bits.

    Raises:
        TypeError: If it is no number, or not finite.
    """
    if isinstance(value, Number):
        return value.term
    if isinstance(value, int | Fraction) or (isinstance(value, float) and math.isfinite(value)):
        return z3.RealVal(Fraction(value))
    raise TypeError(f"expected a finite number, got {value!r} of type {type(value).__name__}")


def _is_infinite(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)


def _infinite(infinity: Exact, factor: Number) -> Exact:
    """An infinite speed limit, say, times a number that is not known.

    Raises:
        ArithmeticError: If that is zero.
    """
    if factor > 0:
        return infinity
    if factor < 0:
        return -infinity
    raise ArithmeticError("infinity times zero is no number")


class Number:
    """A real number, known only as a z3 term; it behaves as a float does in formulas."""

    __slots__ = ("term",)
    __hash__ = None  # type: ignore[assignment]  # equality of unknown numbers is a question, not a key

    def __init__(self, term: z3.ArithRef) -> None:
        self.term = term

    def __add__(self, other: Number | Exact) -> Number:
        return Number(self.term + term_of(other))

    def __radd__(self, other: Exact) -> Any:
        return other if _is_infinite(other) else Number(term_of(other) + self.term)

    def __sub__(self, other: Number | Exact) -> Number:
        return Number(self.term - term_of(other))

    def __rsub__(self, other: Exact) -> Number:
        return Number(term_of(other) - self.term)

    def __mul__(self, other: Number | Exact) -> Number:
        return Number(self.term * term_of(other))

    def __rmul__(self, other: Exact) -> Any:
        if _is_infinite(other):
            return _infinite(other, self)
        return Number(term_of(other) * self.term)

    def __truediv__(self, other: Number | Exact) -> Number:
        return Number(self.term * _run().inverse(term_of(other)))

    def __rtruediv__(self, other: Exact) -> Number:
        return Number(term_of(other)) / self

    def __neg__(self) -> Number:
        return Number(-self.term)

    def __abs__(self) -> Number:
        return self if self >= 0 else -self

    def __lt__(self, other: Number | Exact) -> Condition | bool:
        return self._compared(other, NEGATIVE)

    def __le__(self, other: Number | Exact) -> Condition | bool:
        return self._compared(other, NOT_POSITIVE)

    def __gt__(self, other: Number | Exact) -> Condition | bool:
        return self._compared(other, POSITIVE)

    def __ge__(self, other: Number | Exact) -> Condition | bool:
        return self._compared(other, NOT_NEGATIVE)

    def __eq__(self, other: object) -> Condition:  # type: ignore[override]  # not known yet
        return Condition(self.term - term_of(other), ZERO)

    def __ne__(self, other: object) -> Condition:  # type: ignore[override]  # not known yet
        return Condition(self.term - term_of(other), NOT_ZERO)

    def _compared(self, other: Number | Exact, signs: frozenset[int]) -> Condition | bool:
        if isinstance(other, float) and math.isinf(other):
            return (-1 if other > 0 else 1) in signs
        return Condition(self.term - term_of(other), signs)


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
        root = root_of(square)
        self.obligations.append(square >= 0)
        self.definitions[str(root)] = z3.Implies(
            square >= 0, z3.And(root >= 0, root * root == square)
        )
        return root

    def inverse(self, divisor: z3.ArithRef) -> z3.ArithRef:
        inverse = inverse_of(divisor)
        if not z3.is_rational_value(inverse):
            self.obligations.append(divisor != 0)
            self.definitions[str(inverse)] = z3.Implies(divisor != 0, inverse * divisor == 1)
        return inverse

    def circle(self, angle: z3.ArithRef) -> tuple[z3.ArithRef, z3.ArithRef]:
        cosine, sine = cosine_of(angle), sine_of(angle)
        self.definitions[str(sine)] = cosine * cosine + sine * sine == 1
        return cosine, sine


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


def _sine(angle: Number | Exact) -> Number:
    return Number(_run().circle(term_of(angle))[1])


def _cosine(angle: Number | Exact) -> Number:
    return Number(_run().circle(term_of(angle))[0])


# What formulas use of `math`; anything else fails by name.
SYMBOLIC_MATH = SimpleNamespace(
    sqrt=lambda square: Number(_run().root(term_of(square))),
    sin=_sine,
    cos=_cosine,
    inf=math.inf,
)


def rebound(
    function: Callable[P, T],
    mathematics: SimpleNamespace,
    summaries: Mapping[str, object] | None = None,
) -> Callable[P, T]:
    """Rebuild a shipped function from its own byte code, with another `math`.

    The functions that it calls are rebuilt alike; nothing else changes.

    Args:
        function: A formula, compiled or not.
        mathematics: What stands for `math`.
        summaries: Stand-ins for functions that it calls, by name: what a lemma has shown of them, and no more; and for
            constants that speak of rounding.
    """
    source = cast("FunctionType", source_of(function))
    names = dict(source.__globals__)
    for name in source.__code__.co_names:
        value = names.get(name)
        if summaries and name in summaries:
            names[name] = summaries[name]
        elif value is math:
            names[name] = mathematics
        elif isinstance(source_of(cast("Any", value)), FunctionType):
            names[name] = rebound(cast("Callable[..., object]", value), mathematics, summaries)
    rebuilt = FunctionType(
        source.__code__, names, source.__name__, source.__defaults__, source.__closure__
    )
    return cast("Callable[P, T]", rebuilt)


def symbolic(
    function: Callable[..., Any], summaries: Mapping[str, object] | None = None
) -> Callable[..., Any]:
    """Rebuild a shipped function so that it runs on numbers that are not known; call it inside `paths`."""
    return rebound(function, SYMBOLIC_MATH, summaries)


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """One way through a function.

    Attributes:
        conditions: What is true of the arguments on this way.
        definitions: What the roots, quotients and sines of this way are.
        obligations: What must be true for the formula to mean anything: of divisors and squares.
        result: What the function returned.
    """

    conditions: tuple[z3.BoolRef, ...]
    definitions: tuple[z3.BoolRef, ...]
    obligations: tuple[z3.BoolRef, ...]
    result: tuple[Any, ...]

    @property
    def taken(self) -> z3.BoolRef:
        """All conditions and definitions as one term."""
        return z3.And(*self.conditions, *self.definitions)

    @property
    def is_defined(self) -> z3.BoolRef:
        """All obligations as one term."""
        return z3.And(*self.obligations)


def paths(function: Callable[[], tuple[Any, ...]]) -> list[Path]:
    """Run ``function`` once for every way through it.

    Args:
        function: Calls `symbolic` functions on `Number`; anything it writes to it must make itself.

    Returns:
        Ways whose conditions exclude each other and leave nothing out.

    Raises:
        RecursionError: If there are more than `MAX_PATHS`.
    """
    found: list[Path] = []
    pending: list[tuple[bool, ...]] = [()]
    while pending:
        if len(found) == MAX_PATHS:
            raise RecursionError(f"more than {MAX_PATHS} ways through {function}")
        run = _Run(pending.pop())
        with _running(run):
            result = function()
        definitions = tuple(run.definitions.values())
        found.append(Path(tuple(run.conditions), definitions, tuple(run.obligations), result))
        new = range(len(run.prefix), len(run.taken))
        pending.extend((*run.taken[:place], not run.taken[place]) for place in new)
    return found


@contextlib.contextmanager
def _running(run: _Run) -> Iterator[None]:
    token = _current.set(run)
    try:
        yield
    finally:
        _current.reset(token)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Variables for what a shipped function returns.

    Attributes:
        values: One variable a number returned.
        is_defined: Is every divisor not zero, and every square not negative, on the way that is taken?
        ways: "These are what the function returns", as alternatives: one for every way through it.
    """

    values: tuple[z3.ArithRef, ...]
    is_defined: z3.BoolRef
    ways: tuple[z3.BoolRef, ...]


def outcome(names: str, function: Callable[[], tuple[Any, ...]]) -> Outcome:
    """Name what a shipped function returns.

    Args:
        names: Names of the numbers returned, with spaces between.
        function: As for `paths`.
    """
    values = tuple(z3.Reals(names))
    is_defined = z3.Bool(f"{names} defined")
    return Outcome(
        values,
        is_defined,
        tuple(
            z3.And(way.taken, is_defined == way.is_defined, *_equal(values, way.result))
            for way in paths(function)
        ),
    )


def _equal(values: Sequence[z3.ArithRef], results: Sequence[Any]) -> Iterator[z3.BoolRef]:
    for value, result in zip(values, results, strict=True):
        yield value == term_of(result)

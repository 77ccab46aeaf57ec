"""Terms of z3: polynomials written alike, and variables that stand for roots, quotients, sines and cosines.

Such a variable is named by its argument, so equal arguments have one variable, and different ones never share one.
"""

from __future__ import annotations

import z3


def canonical(term: z3.ArithRef) -> z3.ArithRef:
    """Write equal polynomials alike."""
    return z3.simplify(term, som=True, sort_sums=True)


def root_of(square: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for a square root."""
    return _value_of("sqrt", square)


def inverse_of(divisor: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for one over a divisor; the number itself where the divisor is known."""
    divisor = canonical(divisor)
    if z3.is_rational_value(divisor) and divisor.as_fraction() != 0:
        return z3.RealVal(1 / divisor.as_fraction())
    return _value_of("1/", divisor)


def cosine_of(angle: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for a cosine."""
    return _value_of("cos", angle)


def sine_of(angle: z3.ArithRef) -> z3.ArithRef:
    """The variable that stands for a sine."""
    return _value_of("sin", angle)


def _value_of(function: str, argument: z3.ArithRef) -> z3.ArithRef:
    """Variable for a function's value, named by its argument: equal polynomials have one, others never."""
    return z3.Real(f"{function}({canonical(argument).sexpr()})")

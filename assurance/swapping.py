"""Put other source in place of a module that is imported already, wherever its functions have gone.

Importing a mutant anew costs a second, running its first test a few milliseconds. So functions stay the objects that
they are, whoever holds them, and get other code; constants are replaced in every module of this package that has them
by name. Works for interpreted functions: numba must be off.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator, Mapping
from types import CodeType, FunctionType, ModuleType


def swap_source(module: ModuleType, source: str) -> int:
    """Give a module the functions and constants of other source that defines the same names.

    Args:
        module: What is imported.
        source: What it would have been imported from.

    Returns:
        How many functions and constants differ now. 0 says that the source does the same, or that this could not swap
        what differs.

    Raises:
        KeyError: If the source defines a function that the module has not.
    """
    other: dict[str, object] = {"__name__": module.__name__, "__file__": module.__file__}
    exec(compile(source, str(module.__file__), "exec"), other)
    here = dict(_functions(vars(module), module.__name__))
    changed = 0
    for name, function in _functions(other, module.__name__):
        changed += _swap_function(here[name], function)
    constants = {name: value for name, value in other.items() if _is_constant(name, value)}
    for name, value in constants.items():
        if repr(value) != repr(vars(module)[name]):
            _replace_everywhere(name, vars(module)[name], value)
            changed += 1
    return changed


def _functions(
    namespace: Mapping[str, object], module: str, prefix: str = ""
) -> Iterator[tuple[str, FunctionType]]:
    """Functions that a module defines, those of its classes too, by their dotted names."""
    for name, value in list(namespace.items()):
        if isinstance(value, type):
            if value.__module__ == module:
                yield from _functions(vars(value), module, f"{prefix}{name}.")
            continue
        inner = getattr(value, "__func__", None) or getattr(value, "fget", None) or value
        function = inspect.unwrap(inner) if callable(inner) else None
        if isinstance(function, FunctionType) and function.__module__ == module:
            yield prefix + name, function


def _swap_function(function: FunctionType, other: FunctionType) -> bool:
    """Give a function the code and the defaults of another; returns whether they differ."""
    differs = (
        _meaning(function.__code__) != _meaning(other.__code__)
        or repr(function.__defaults__) != repr(other.__defaults__)
        or repr(function.__kwdefaults__) != repr(other.__kwdefaults__)
    )
    if differs:
        function.__code__ = other.__code__
        function.__defaults__ = other.__defaults__
        function.__kwdefaults__ = other.__kwdefaults__
    return differs


def _meaning(code: CodeType) -> tuple[object, ...]:
    """What code does, without where it is written. Constants as text: 1, 1.0 and True are equal otherwise."""
    constants = [
        _meaning(part) if isinstance(part, CodeType) else repr(part) for part in code.co_consts
    ]
    return code.co_code, code.co_names, code.co_varnames, tuple(constants)


def _is_constant(name: str, value: object) -> bool:
    return not name.startswith("__") and isinstance(value, bool | int | float | str | tuple)


def _replace_everywhere(name: str, before: object, after: object) -> None:
    for module in list(sys.modules.values()):
        if module.__name__.startswith("safefilter") and vars(module).get(name) is before:
            setattr(module, name, after)

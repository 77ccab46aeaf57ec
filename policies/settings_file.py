"""Settings of a training as plain data, and as files in YAML or JSON.

What a file gets wrong is told with its line and the reason, one line for each fault; nothing is guessed: texts are no
truth values, and 2.5 is no number of passes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_origin

import cattrs
from cattrs.errors import ClassValidationError, ForbiddenExtraKeysError, IterableValidationError
from cattrs.gen import make_dict_structure_fn

from envs.norm_area import NormArea
from envs.reward import Reading
from envs.scenarios.yaml_lines import YamlFile, way_text
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"
Way: TypeAlias = tuple[int | str, ...]
"""Keys and indices that lead to a value."""


def plain_settings(settings: TrainingSettings) -> dict[str, Plain]:
    """Settings as JSON takes them."""
    plain: dict[str, Plain] = _converter().unstructure(settings)
    return plain


def settings_of(plain: object, what: str = "settings") -> TrainingSettings:
    """Settings from plain data; what is not said is as by default.

    Args:
        plain: A dictionary with the names of `TrainingSettings`.
        what: Where it comes from, for messages.

    Raises:
        InvalidInput: If a name is unknown, or a value cannot be used.
    """
    try:
        return _structured(plain)
    except (ClassValidationError, InvalidInput) as error:
        faults = "; ".join(f"{way_text(way)}{reason}" for way, reason in _faults(error))
        raise InvalidInput(f"{what}: {faults}") from None


def read_settings(path: Path) -> TrainingSettings:
    """Read a file of settings, in YAML (or JSON, which is YAML).

    Args:
        path: The file.

    Raises:
        InvalidInput: If there is no such file, or it says something else: file, line and reason of every fault.
    """
    file = YamlFile.read(path)
    try:
        return _structured(file.content)
    except (ClassValidationError, InvalidInput) as error:
        found = ((*file.find(way), reason) for way, reason in _faults(error))
        faults = sorted(found, key=lambda fault: fault[0])
        raise InvalidInput(
            "\n".join(f"{path}:{line}: {way_text(keys)}{reason}" for line, keys, reason in faults)
        ) from None


def differences(one: Plain, other: Plain, way: Way = ()) -> Iterator[str]:
    """Say in what two settings differ: ``ppo.clip: 0.2 and 0.3``.

    Args:
        one: As `plain_settings` gives them.
        other: The same, of other settings.
        way: Where they stand.
    """
    if isinstance(one, dict) and isinstance(other, dict):
        for name in sorted(one.keys() | other.keys()):
            yield from differences(one.get(name), other.get(name), (*way, name))
    elif one != other:
        yield f"{way_text(way)}{one} and {other}"


def _structured(plain: object) -> TrainingSettings:
    return _converter().structure(plain, TrainingSettings)


@cache
def _converter() -> cattrs.Converter:
    converter = cattrs.Converter()
    converter.register_unstructure_hook(NormArea, lambda area: area.corners.tolist())
    converter.register_unstructure_hook_func(_is_tuple, list)
    converter.register_structure_hook_factory(is_dataclass, lambda kind: _record(converter, kind))
    converter.register_structure_hook(NormArea, lambda corners, _: NormArea(corners))
    converter.register_structure_hook(bool, _truth)
    converter.register_structure_hook(int, _whole)
    converter.register_structure_hook(float, _number)
    converter.register_structure_hook(Reading, _reading)
    # Whoever has a field of few words checks it, and says which there are.
    converter.register_structure_hook_func(_is_literal, _as_it_is)
    tuples = converter.get_structure_hook(tuple[int, ...])
    converter.register_structure_hook_func(
        _is_tuple, lambda value, kind: tuples(_listed(value), kind)
    )
    return converter


def _record(
    converter: cattrs.Converter, kind: type[Any]
) -> Callable[[Any, type[Any]], TrainingSettings]:
    """What makes records of a class from mappings."""
    make = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True)

    def structure(value: Any, _: type[Any]) -> Any:  # what it is, is yet to be seen
        if not isinstance(value, dict):
            raise InvalidInput(
                f"expected a mapping with some of {', '.join(_names(kind))}, got {value!r}"
            )
        return make(value, kind)

    return structure


def _faults(error: BaseException, way: Way = ()) -> Iterator[tuple[Way, str]]:
    """What is wrong where."""
    if isinstance(error, IterableValidationError):
        of_items, of_list = error.group_exceptions()
        for inner, item in of_items:
            yield from _faults(inner, (*way, item.index))
        for inner in of_list:
            yield from _faults(inner, way)
    elif isinstance(error, ClassValidationError):
        of_fields, of_whole = error.group_exceptions()
        for inner, place in of_fields:
            yield from _faults(inner, (*way, place.name))
        for inner in of_whole:
            # A record that finds a value wrong begins with its name. (Names that are no texts have no message.)
            said = "" if isinstance(inner, ForbiddenExtraKeysError) else str(inner)
            name, colon, reason = said.partition(": ")
            is_named = bool(colon) and name in _names(error.cl)
            yield from ([((*way, name), reason)] if is_named else _faults(inner, way))
    elif isinstance(error, ForbiddenExtraKeysError):
        for name in sorted(map(str, error.extra_fields)):
            expected = ", ".join(_names(error.cl))
            yield (*way, name), f"no such setting; expected one of {expected}"
    else:
        yield way, str(error)


def _names(kind: type[Any]) -> list[str]:
    return [field.name for field in fields(kind)]


def _is_literal(kind: Any) -> bool:  # any type
    origin: object = get_origin(kind)
    return origin is Literal


def _is_tuple(kind: Any) -> bool:  # any type
    return get_origin(kind) is tuple


def _as_it_is(value: Any, _: Any) -> Any:  # a record will look at it
    return value


def _truth(value: object, _: object) -> bool:
    """True or false.

    Raises:
        InvalidInput: If it is neither.
    """
    if isinstance(value, bool):
        return value
    raise InvalidInput(f"expected true or false, got {value!r}")


def _whole(value: object, _: object) -> int:
    """A whole number.

    Raises:
        InvalidInput: If it is something else.
    """
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    raise InvalidInput(f"expected a whole number, got {value!r}")


def _number(value: object, _: object) -> float:
    """A number; 5e-4 as well, which YAML takes for a text.

    Raises:
        InvalidInput: If it is something else.
    """
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        try:
            return float(value)
        except ValueError:
            pass
    raise InvalidInput(f"expected a number, got {value!r}")


def _reading(value: object, _: object) -> Reading:
    """A reading, by its value.

    Raises:
        InvalidInput: If there is no such reading.
    """
    known = {reading.value: reading for reading in Reading}
    if isinstance(value, str) and value in known:
        return known[value]
    raise InvalidInput(f"expected one of {', '.join(known)}, got {value!r}")


def _listed(value: object) -> list[object]:
    """A list, and no text, which is one of letters.

    Raises:
        InvalidInput: If it is something else.
    """
    if isinstance(value, list | tuple):
        return list(value)
    raise InvalidInput(f"expected a list, got {value!r}")

"""Reading of scenario files: what pydantic finds wrong, told with file, line and reason."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from envs.scenarios.schema import Specification
from envs.scenarios.yaml_lines import ScenarioFileError, YamlFile, way_text

LONGEST_ECHO = 60
"""So much of a faulty value is repeated in the message, in characters."""


def read_specification(path: Path) -> Specification:
    """Read and check a scenario file.

    Raises:
        ScenarioFileError: If it cannot be read or says something else than the schema allows: file, line and reason
            of every fault.
    """
    file = YamlFile.read(path)
    try:
        return Specification.model_validate(file.content)
    except ValidationError as error:
        raise ScenarioFileError("\n".join(_faults(file, error))) from None


def _faults(file: YamlFile, error: ValidationError) -> list[str]:
    """One line for each fault, in the order of the file."""
    found = error.errors()
    # A list with a faulty item is reported as too short as well, for pydantic counts the good ones only.
    ways = [fault["loc"] for fault in found]
    faults = set()
    for fault in found:
        way = fault["loc"]
        if fault["type"] == "too_short" and any(
            len(other) > len(way) and other[: len(way)] == way for other in ways
        ):
            continue
        line, keys = file.find(way)
        reason = fault["msg"].removeprefix("Value error, ").replace("tuple", "list")
        given = repr(fault["input"])
        shown = given if len(given) <= LONGEST_ECHO else f"{given[:LONGEST_ECHO]} ..."
        faults.add((line, f"{way_text(keys)}{reason}, got {shown}"))
    return [f"{file.path}:{line}: {text}" for line, text in sorted(faults)]

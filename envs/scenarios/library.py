"""The library: scenarios that come with this package, and those of users, by name or file."""

from __future__ import annotations

from pathlib import Path

from envs.scenarios.described import DescribedScenario
from envs.scenarios.reading import read_specification
from safefilter.arguments import file_path
from safefilter.errors import InvalidInput

LIBRARY = Path(__file__).parent / "library"


class UnknownScenario(InvalidInput):
    """The library has no scenario of this name."""


def scenario_names() -> list[str]:
    """Names that `load_scenario` knows, in order."""
    return sorted(path.stem for path in LIBRARY.glob("*.yaml"))


def load_scenario(name: str | Path) -> DescribedScenario:
    """Load a scenario of the library, or one of your own.

    Args:
        name: A name of `scenario_names`, or the path of a file that ends in ``.yaml``; see ``docs/scenarios.md``.

    Raises:
        UnknownScenario: If the library has no such name.
        ScenarioFileError: If the file cannot be used: file, line and reason.
    """
    path = file_path(name, "scenario")
    if path.suffix not in {".yaml", ".yml"}:
        if str(name) not in scenario_names():
            raise UnknownScenario(
                f"scenario {str(name)!r}: expected one of {', '.join(scenario_names())}, "
                "or the path of a .yaml file"
            )
        path = LIBRARY / f"{name}.yaml"
    return DescribedScenario.of(read_specification(path))

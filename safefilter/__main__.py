"""``safefilter`` on the command line; ``safefilter compare`` is what there is."""

from __future__ import annotations

import importlib
import sys

USAGE = """usage: safefilter compare [options]

  compare   which solver should I use, and at what setting? See `safefilter compare --help`.
"""
# From a command to the module that runs it, and the extra that it needs.
COMMANDS = {"compare": ("safefilter.comparison.command", "compare")}
HELP = {"-h", "--help"}


def main(arguments: list[str] | None = None) -> int:
    """Run a command; returns the exit code.

    Raises:
        ModuleNotFoundError: If a file of this package is missing: the installation is broken.
    """
    words = sys.argv[1:] if arguments is None else arguments
    if not words or words[0] not in COMMANDS:
        asked = bool(words) and words[0] in HELP
        (sys.stdout if asked else sys.stderr).write(USAGE)
        return 0 if asked else 2
    name, extra = COMMANDS[words[0]]
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] == "safefilter":
            raise
        sys.stderr.write(
            f"safefilter {words[0]} needs {error.name}: pip install 'safefilter[{extra}]'\n"
        )
        return 2
    code: int = module.run(words[1:])
    return code


if __name__ == "__main__":
    sys.exit(main())

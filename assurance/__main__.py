"""Plant each bug, and print which check catches it after how many examples: ``python -m assurance``.

Ends with exit code 1 if one is not caught. Takes a minute or two: kernels are interpreted, so that a bug in one place
reaches everything that uses it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

INTERPRETED = "NUMBA_DISABLE_JIT"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m assurance", description=__doc__)
    parser.add_argument("--only", default="", help="bugs whose name holds this")
    options = parser.parse_args(arguments)
    # Whether numba compiles is decided when it is imported.
    if os.environ.get(INTERPRETED) != "1":
        command = [sys.executable, "-m", "assurance", *(arguments or sys.argv[1:])]
        environment = {**os.environ, INTERPRETED: "1"}
        return subprocess.run(command, env=environment, check=False).returncode
    from assurance.table import print_table  # noqa: PLC0415  # see above

    return print_table(options.only)


if __name__ == "__main__":
    sys.exit(main())

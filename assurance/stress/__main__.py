"""Drive every kind of case until 10^8 robot-steps are made, and count what must not be: ``python -m assurance.stress``.

A run that is stopped in any way, ``kill -9`` too, goes on where it was with the same command. ``--case N`` drives one
case again and says where it fails. Ends with exit code 1 if there was a collision, or anything executed that was not
certified.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

# Each process has a core to itself. Read by libraries when they are loaded.
os.environ.update(
    dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
)

from assurance.stress.campaign import run_campaign, run_one, write_report  # see above
from assurance.stress.cases import Campaign
from safefilter.errors import SafeFilterError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m assurance.stress", description=__doc__)
    parser.add_argument("--steps", type=float, default=1e8, help="robot-steps (default: 1e8)")
    parser.add_argument("--seed", type=int, default=0, help="of everything (default: 0)")
    parser.add_argument("--processes", type=int, default=2, help="that drive (default: 2)")
    parser.add_argument(
        "--scale", type=float, default=1.0, help="size of cases, as a part of the usual one"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/stress"), help="folder of log and report"
    )
    parser.add_argument("--case", type=int, help="drive this case alone, and tell of each failure")
    parser.add_argument(
        "--report", action="store_true", help="drive nothing, write the report of what there is"
    )
    options = parser.parse_args(arguments)
    try:
        campaign = Campaign(options.seed, options.scale)
        if options.case is not None:
            return run_one(campaign, options.case)
        if options.report:
            return write_report(options.out)
        return run_campaign(campaign, int(options.steps), options.processes, options.out)
    except SafeFilterError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("stopped; the same command goes on\n")
        return 130


if __name__ == "__main__":
    sys.exit(main())

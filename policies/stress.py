"""Drive differential drives between walls for a number of robot-steps, and count collisions.

``python -m policies.stress --steps 1e6 --seed 0`` prints, for the same trials: the filter as it is, the filter without
the cap on arcs, Priority-ORCA alone, and no filter at all. It ends with exit code 1 if the first has a collision or
executes anything that is not certified, and names the trials.
"""

from __future__ import annotations

import argparse
import sys
from time import perf_counter

from policies.drive_campaign import WAYS, DriveTally, Way, drive_campaign
from policies.drive_trials import DriveTrial

HEADER = (
    f"{'':16}{'robot-steps':>12}{'with robots':>12}{'with walls':>11}{'per 1e6':>9}{'robots mm':>11}{'walls mm':>11}"
    f"{'Case-1':>10}{'Case-2':>10}{'Case-3':>10}{'uncertified':>12}{'s':>7}\n"
)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m policies.stress",
        description="Drive differential drives between walls and count collisions, with the filter and without parts.",
    )
    parser.add_argument("--steps", type=float, default=1e6, help="robot-steps (default: 1e6)")
    parser.add_argument("--seed", type=int, default=0, help="of everything (default: 0)")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS, help="default: all")
    options = parser.parse_args(arguments)
    sys.stdout.write(HEADER)
    tallies = {way: _row(way, int(options.steps), options.seed) for way in options.ways}
    filtered = tallies.get("filter on", DriveTally())
    return int(filtered.contacts + filtered.uncertified > 0)


def _row(way: Way, robot_steps: int, seed: int) -> DriveTally:
    start, named = perf_counter(), []

    def watch(trial: DriveTrial, tally: DriveTally) -> None:
        if way == "filter on" and tally.contacts + tally.uncertified > 0:
            named.append(f"{'':16}{tally} in {trial.name}, seed {trial.seed}\n")

    tally = drive_campaign(way, robot_steps, seed, watch)
    cases = "".join(f"{number:>10}" for number in tally.cases)
    sys.stdout.write(
        f"{way:16}{tally.robot_steps:>12}{tally.robot_contacts:>12}{tally.wall_contacts:>11}"
        f"{1e6 * tally.contacts / tally.robot_steps:>9.0f}"
        f"{1e3 * tally.clearance:>11.3g}{1e3 * tally.wall_clearance:>11.3g}"
        f"{cases}{tally.uncertified:>12}{perf_counter() - start:>7.1f}\n"
    )
    sys.stdout.writelines(named)
    sys.stdout.flush()
    return tally


if __name__ == "__main__":
    sys.exit(main())

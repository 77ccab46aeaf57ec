"""Drive random crowds for a number of robot-steps, and count collisions with and without the filter.

``python -m safefilter.testing.stress --steps 1e6 --backend planar --seed 0`` prints, for the same crowds and policies:
the filter as it is, the filter without `Separation` (which is Priority-ORCA alone), and no filter at all. It ends with
exit code 1 if the first has a collision or executes anything that is not certified.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from time import perf_counter

from safefilter.backends.registry import available_backends
from safefilter.decision import Fault
from safefilter.safety_filter import SafetyFilter
from safefilter.testing.campaign import Setting, drive
from safefilter.testing.tally import Tally

HEADER = (
    f"{'':32}{'robot-steps':>12}{'collisions':>11}{'per 1e6':>9}{'clearance mm':>14}"
    f"{'Case-1':>10}{'Case-2':>10}{'Case-3':>10}{'uncertified':>12}{'faults':>8}{'s':>7}\n"
)
REFRESH_SECONDS = 0.5


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m safefilter.testing.stress",
        description="Drive random crowds and count collisions, with the filter, without separation, and without both.",
    )
    parser.add_argument("--steps", type=float, default=1e6, help="robot-steps (default: 1e6)")
    parser.add_argument("--backend", default="planar", help="a backend, or 'all' (default: planar)")
    parser.add_argument("--seed", type=int, default=0, help="of crowds and policies (default: 0)")
    options = parser.parse_args(arguments)
    backends = available_backends() if options.backend == "all" else (options.backend,)
    sys.stdout.write(HEADER)
    tallies = [
        _row(
            f"filter on, {backend}",
            partial(Setting.safety_filter, backend=backend),
            int(options.steps),
            options.seed,
        )
        for backend in backends
    ]
    _row(
        "separation off, ORCA on, planar",
        partial(Setting.safety_filter, has_separation=False),
        int(options.steps),
        options.seed,
    )
    _row("filter off", lambda _: None, int(options.steps), options.seed)
    return int(any(tally.collisions + tally.uncertified > 0 for tally in tallies))


def _row(
    name: str, make_filter: Callable[[Setting], SafetyFilter | None], robot_steps: int, seed: int
) -> Tally:
    progress = _Progress(name, robot_steps)
    start = perf_counter()
    tally = drive(make_filter, robot_steps, seed, progress.show)
    progress.clear()
    cases = "".join(f"{number:>10}" for number in tally.cases)
    sys.stdout.write(
        f"{name:32}{tally.robot_steps:>12}{tally.collisions:>11}"
        f"{1e6 * tally.collisions / tally.robot_steps:>9.0f}{1e3 * tally.min_clearance:>14.3g}{cases}"
        f"{tally.uncertified:>12}{tally.num_faults:>8}{perf_counter() - start:>7.1f}\n"
    )
    for fault, number in zip(Fault, tally.faults, strict=True):
        if number > 0 and fault is not Fault.NONE:
            sys.stdout.write(f"{'':32}{number:>12} {fault.name}\n")
    sys.stdout.flush()
    return tally


class _Progress:
    """One line on a terminal, and nothing anywhere else."""

    def __init__(self, name: str, robot_steps: int) -> None:
        self._name, self._robot_steps = name, robot_steps
        self._shown = 0.0

    def show(self, tally: Tally) -> None:
        if not sys.stderr.isatty() or perf_counter() - self._shown < REFRESH_SECONDS:
            return
        self._shown = perf_counter()
        part = min(1.0, tally.robot_steps / self._robot_steps)
        sys.stderr.write(f"\r{self._name}: {part:.0%}, {tally.collisions} collisions\033[K")
        sys.stderr.flush()

    def clear(self) -> None:
        if sys.stderr.isatty():
            sys.stderr.write("\r\033[K")


if __name__ == "__main__":
    sys.exit(main())

"""Make the problem sets that come with the package: ``python -m safefilter.comparison.make_problems``.

The same seed makes the same files, bit for bit, on the same machine and versions; on others the last bits of sines may
differ. Right answers are found in rational arithmetic and written beside the problems: for 50 variables that takes a
minute.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from safefilter.comparison import make_plane
from safefilter.comparison.contender import accuracy_of
from safefilter.comparison.make_barriers import barrier_problems
from safefilter.comparison.make_driven import (
    circle,
    crossroad,
    crowd,
    driven_problems,
    head_on_problems,
)
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem, ProblemSet
from safefilter.comparison.problem_file import write_problems
from safefilter.comparison.shipped import FOLDER, SHIPPED, SUFFIX

SEED = 20260101
BOX = "half a side of the box"


class Recipe(NamedTuple):
    """How a set is made.

    Attributes:
        description: See `ProblemSet`.
        make: From a source of chance to problems.
        unit: See `ProblemSet`.
    """

    description: str
    make: Callable[[np.random.Generator], list[Problem]]
    unit: str = "m/s"


RECIPES: Mapping[str, Recipe] = {
    "recorded_crossroad": Recipe(
        "Consecutive decisions of 2 of 16 robots on a crossroad, two abreast from four sides.",
        lambda _: driven_problems(crossroad(), 2, 10),
    ),
    "recorded_circle": Recipe(
        "Consecutive decisions of 2 of the 250 robots of RVO2's Circle, where the ring closes.",
        lambda _: driven_problems(circle(), 2, 10),
    ),
    "recorded_crowd": Recipe(
        "Consecutive decisions of 2 of 64 robots in a full square, all to the opposite side.",
        lambda _: driven_problems(crowd(), 2, 10),
    ),
    "case_2": Recipe(
        "Random rows that leave room of 5 % of v_max or more; the wanted velocity is outside.",
        lambda rng: make_plane.case_2(rng, 20),
    ),
    "barely_feasible": Recipe(
        "Sets whose inner radius is 1e-3 to 1e-9 of v_max: triangles, a slab, a needle.",
        lambda rng: make_plane.barely(rng, -1.0),
    ),
    "barely_empty": Recipe(
        "Rows that miss each other by 1e-3 to 1e-9 of v_max: triangles, a slab, a needle.",
        lambda rng: make_plane.barely(rng, 1.0),
    ),
    "clearly_empty": Recipe(
        "Random rows that contradict each other by 10 % of v_max or more.",
        lambda rng: make_plane.clearly_empty(rng, 16),
    ),
    "degenerate": Recipe(
        "Parallel, duplicate, opposite and zero rows, corners of six rows, wishes on a row.",
        lambda rng: make_plane.degenerate(rng, 24),
    ),
    "badly_scaled": Recipe(
        "Speed limits of 1e-6 to 1e6 m/s, and wishes and rows 1e-6 to 1e6 times the limit.",
        make_plane.badly_scaled,
    ),
    "head_on": Recipe(
        "Case-3: one robot, or one ahead and one behind, at full speed and exactly in line or nearly so.",
        lambda rng: head_on_problems(rng, 20),
    ),
    "barriers_3": Recipe(
        "Barriers of a drone among moving obstacles: 3 variables, decisions in a row.",
        lambda rng: barrier_problems(rng, 1, 3, 20),
        BOX,
    ),
    "barriers_6": Recipe(
        "Barriers of 2 drones and obstacles: 6 variables, decisions in a row.",
        lambda rng: barrier_problems(rng, 2, 3, 20),
        BOX,
    ),
    "barriers_12": Recipe(
        "Barriers of 4 drones and obstacles: 12 variables, decisions in a row.",
        lambda rng: barrier_problems(rng, 4, 3, 12),
        BOX,
    ),
    "barriers_50": Recipe(
        "Barriers of 25 robots in a plane and obstacles: 50 variables, decisions in a row.",
        lambda rng: barrier_problems(rng, 25, 2, 4),
        BOX,
    ),
}


def make_set(name: str, seed: int = SEED) -> ProblemSet:
    """Make a set and find the right answers."""
    recipe = RECIPES[name]
    # Each set has numbers of its own, so that a change of one leaves the others as they are.
    rng = np.random.default_rng([seed, SHIPPED.index(name)])
    problems = tuple(recipe.make(rng))
    truths = {
        number: truth_of(problem, accuracy_of(problem.scale))
        for number, problem in enumerate(problems)
    }
    return ProblemSet(name, recipe.description, recipe.unit, problems, truths)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m safefilter.comparison.make_problems", description="Make the problem sets."
    )
    parser.add_argument("names", nargs="*", help="which (default: all)", default=[])
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--folder", type=Path, default=FOLDER)
    options = parser.parse_args(arguments)
    unknown = set(options.names) - set(SHIPPED)
    if unknown:
        parser.error(
            f"no set is called {', '.join(sorted(unknown))}; there are {', '.join(SHIPPED)}"
        )
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.names or SHIPPED:
        problems = make_set(name, options.seed)
        path = options.folder / f"{name}{SUFFIX}"
        write_problems(path, problems)
        sys.stdout.write(f"{len(problems):4} problems, {path.stat().st_size:7} bytes: {path}\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Cases by number: what case k of a campaign is, and what it shows, depends on the seed and k alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import process_time
from typing import Any

import numpy as np

from assurance.stress.kinds import BY_NAME, CYCLE, Draw, Drive, Kind
from assurance.stress.moments import Failure, Moment
from safefilter.arrays import positive_number
from safefilter.errors import OutOfRange
from safefilter.testing.tally import NOTHING, Tally

MOST_FAILURES = 10
"""Told of each case; all are counted."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a case showed.

    Attributes:
        number: Of the case.
        kind: Name of its kind.
        name: What was drawn.
        tally: Counts.
        failures: The first `MOST_FAILURES` of them.
        seconds: Of the processor.
    """

    number: int
    kind: str
    name: str
    tally: Tally
    failures: tuple[Failure, ...]
    seconds: float

    @property
    def has_failed(self) -> bool:
        """Was there a contact, or anything executed that was not certified?"""
        return self.tally.collisions + self.tally.uncertified > 0

    def as_json(self) -> dict[str, Any]:
        """In types that JSON has; what is infinite is null."""
        record = asdict(self)
        least = self.tally.min_clearance
        record["tally"]["min_clearance"] = least if math.isfinite(least) else None
        record["seconds"] = round(self.seconds, 3)
        return record

    @classmethod
    def from_json(cls, record: dict[str, Any]) -> Result:
        """Take back what `as_json` gave; a log that was not altered holds nothing else."""
        tally = dict(record["tally"])
        tally["cases"], tally["faults"] = tuple(tally["cases"]), tuple(tally["faults"])
        if tally["min_clearance"] is None:
            tally["min_clearance"] = math.inf
        failures = [
            Failure(**{**failure, "who": tuple(failure["who"])}) for failure in record["failures"]
        ]
        return cls(**{**record, "tally": Tally(**tally), "failures": tuple(failures)})


@dataclass(frozen=True, slots=True)
class Campaign:
    """What all cases of a campaign depend on.

    Attributes:
        seed: Of everything.
        scale: Robots of each case, as a part of what its kind has; for tests, and for a look at every kind.
    """

    seed: int
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            OutOfRange: If the seed is below 0, or the scale not above it.
        """
        if self.seed < 0:
            raise OutOfRange(f"seed: expected 0 or more, got {self.seed}")
        positive_number(self.scale, "scale")


def kind_of(number: int) -> Kind:
    """The kind of a case."""
    return BY_NAME[CYCLE[number % len(CYCLE)]]


def draw_case(campaign: Campaign, number: int) -> Drive:
    """Draw a case.

    Args:
        campaign: Which one.
        number: Of the case, from 0 on.

    Raises:
        OutOfRange: If the number is below 0.
    """
    if number < 0:
        raise OutOfRange(f"case: expected 0 or more, got {number}")
    kind = kind_of(number)
    num_robots = max(1, round(campaign.scale * kind.size.num_robots))
    cycles, place = divmod(number, len(CYCLE))
    turn = cycles * CYCLE.count(kind.name) + CYCLE[:place].count(kind.name)
    rng = np.random.default_rng([campaign.seed, number])
    size = kind.size._replace(num_robots=num_robots)
    return kind.drive(Draw(rng, turn, int(rng.integers(2**31)), size))


def run_case(
    campaign: Campaign, number: int, watch: Callable[[Moment], object] = lambda _: None
) -> Result:
    """Drive a case from its start to its last step.

    Args:
        campaign: Which one.
        number: Of the case.
        watch: Told of each step.
    """
    begun = process_time()
    drive = draw_case(campaign, number)
    tally, failures = NOTHING, list[Failure]()
    for moment in drive.moments:
        watch(moment)
        tally += moment.tally
        failures += moment.failures[: MOST_FAILURES - len(failures)]
    seconds = process_time() - begun
    return Result(number, kind_of(number).name, drive.name, tally, tuple(failures), seconds)


def replay(campaign: Campaign, number: int) -> str:
    """The command that drives one case again, step by step the same."""
    scale = "" if campaign.scale == 1.0 else f" --scale {campaign.scale}"
    return f"python -m assurance.stress --seed {campaign.seed}{scale} --case {number}"

"""Summary: all measures of a comparison as lines of plain numbers, for tables, JSON and CSV."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from safefilter.comparison.advice import Advice, advice_of
from safefilter.comparison.contender import Contender
from safefilter.comparison.measures import Latency, Measures, judged, measures_of
from safefilter.comparison.problem import groups_of
from safefilter.comparison.runner import Comparison
from safefilter.comparison.worker import Mode


@dataclass(frozen=True, slots=True)
class Line:
    """What a contender's attempts at some problems come to.

    Attributes:
        contender: Who.
        mode: How it was asked.
        problems: Name of the set, `PLANE` or `OTHERS`.
        measures: The measures.
    """

    contender: Contender
    mode: Mode
    problems: str
    measures: Measures

    @property
    def numbers(self) -> dict[str, float | int]:
        """Measures by name; percentiles as ``total_p50`` and so on."""
        found: dict[str, float | int] = {}
        for name, value in self.measures._asdict().items():
            if isinstance(value, Latency):
                found |= {f"{name}_{part}": number for part, number in value._asdict().items()}
            else:
                found[name] = value
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """A comparison, summed up.

    Attributes:
        comparison: What was measured.
        budget: Time that a decision may take, in s.
        advice: Which solver, and at what setting.
        lines: One a contender, mode and set, and one for all sets of a kind together.
    """

    comparison: Comparison
    budget: float
    advice: tuple[Advice, ...]
    lines: tuple[Line, ...]

    @classmethod
    def of(cls, comparison: Comparison, budget: float) -> Summary:
        """Sum up."""
        return cls(
            comparison, budget, advice_of(comparison, budget), tuple(_lines(comparison, budget))
        )

    def of_problems(self, problems: str, mode: Mode) -> list[Line]:
        """Lines of one set, of contenders that take its problems."""
        return [
            line
            for line in self.lines
            if line.problems == problems and line.mode is mode and line.measures.asked
        ]

    @property
    def kinds(self) -> list[str]:
        """Which of `PLANE` and `OTHERS` there are."""
        return list(groups_of(self.comparison.sets))


def _lines(comparison: Comparison, budget: float) -> Iterator[Line]:
    groups = {problems.name: [problems] for problems in comparison.sets}
    for name, sets in (groups_of(comparison.sets) | groups).items():
        for mode in (Mode.SEQUENCE, Mode.COLD):
            for contender in comparison.contenders:
                attempts = judged(comparison, contender, mode, sets)
                yield Line(contender, mode, name, measures_of(attempts, budget))

"""Contender: a backend at a setting, and the solvers that a filter would ask.

Tolerances in the unit of the action.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple

from safefilter.arguments import require_kinds
from safefilter.backend_answer import LINEAR_BACKEND, Solvers
from safefilter.backends.registry import is_registered, make_backend

# What `SafetyFilter` asks of solvers by default, 1 nm/s, at the speed limit of the paper's robots, 0.2 m/s; relative,
# so that problems of other scales are judged alike.
ACCURACY = 5e-9


class Setting(Enum):
    """How accurately a solver is asked to work; the value is the sentence to print."""

    DEFAULT = "as its authors set it"
    TOLERANCE = (
        "as SafetyFilter asks for: 5e-9 of the largest action, mapped to each solver's own settings"
    )
    TIGHT = "a thousand times tighter than that"

    @property
    def title(self) -> str:
        """Name in tables and options."""
        return self.name.lower()


class Contender(NamedTuple):
    """A backend at a setting."""

    backend: str
    setting: Setting

    @property
    def title(self) -> str:
        """Name in tables."""
        return f"{self.backend} @ {self.setting.title}"


def accuracy_of(scale: float) -> float:
    """Tolerance that answers are verified with where the largest action is of this size."""
    return ACCURACY * scale


def asked_of(setting: Setting, scale: float) -> float | None:
    """Tolerance that a solver is asked for; None leaves it at its own settings."""
    if setting is Setting.DEFAULT:
        return None
    return accuracy_of(scale) * (1.0 if setting is Setting.TOLERANCE else 1e-3)


def make_contender(contender: Contender, scale: float) -> Solvers:
    """Make new solvers, as the filter would where the largest action is of this size."""
    asked = asked_of(contender.setting, scale)
    quadratic = make_backend(contender.backend, tolerance=asked)
    is_linear = quadratic.capabilities.lp
    linear = quadratic if is_linear else make_backend(LINEAR_BACKEND, tolerance=asked)
    return Solvers(quadratic, linear, accuracy_of(scale))


def contenders_of(backends: Iterable[str], settings: Iterable[Setting]) -> tuple[Contender, ...]:
    """All backends at all settings; one that was registered has no setting of its authors'.

    Raises:
        InvalidInput: If a name is no text, or a setting none of `Setting`.
    """
    chosen = require_kinds(settings, "settings", Setting)
    return tuple(
        Contender(backend, setting)
        for backend in require_kinds(backends, "backends", str)
        for setting in chosen
        if not (setting is Setting.DEFAULT and is_registered(backend))
    )

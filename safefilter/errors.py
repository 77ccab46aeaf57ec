"""Every error that `safefilter` raises, as one tree.

::

    SafeFilterError
    ├── InvalidInput (ValueError)       a value at the public edge cannot be used
    │   ├── ShapeError                  wrong number of rows, columns or dimensions
    │   ├── NotFinite                   NaN or infinity
    │   ├── OutOfRange                  a radius <= 0, a priority <= 0, ...
    │   └── NotCooperative              asked to decide for a robot that others take for unfiltered
    ├── UnknownBackend (ValueError)     no such solver name
    ├── BackendNotInstalled (ImportError)
    ├── UnsupportedProgram (ValueError) the backend cannot take this kind of program
    ├── BackendFailed (RuntimeError)    a solver failed; keeps the program and the status
    ├── EmptyHardSet (RuntimeError)     the user's hard rows contradict each other, and no fallback was given
    ├── WrapperOrderError (TypeError)   the filter must be the innermost action wrapper
    └── SceneUnavailable (TypeError)    the environment offers no `scene()`

Infeasible is a result (`Status.INFEASIBLE`), not an exception. A message says what was given, what was
expected and what to do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from safefilter.backends.backend import Status
    from safefilter.programs.convex_program import ConvexProgram


class SafeFilterError(Exception):
    """Base of every error raised by this package."""


class InvalidInput(SafeFilterError, ValueError):
    """A value at the public edge cannot be used."""


class ShapeError(InvalidInput):
    """An array has the wrong shape."""


class NotFinite(InvalidInput):
    """A value is NaN or infinite."""


class OutOfRange(InvalidInput):
    """A value is finite but not allowed."""


class NotCooperative(InvalidInput):
    """A decision was asked for a robot that its neighbours take for unfiltered."""


class UnknownBackend(SafeFilterError, ValueError):
    """No backend has this name."""


class BackendNotInstalled(SafeFilterError, ImportError):
    """The backend exists but its package is missing."""


class UnsupportedProgram(SafeFilterError, ValueError):
    """The backend cannot take this kind of program."""


class BackendFailed(SafeFilterError, RuntimeError):
    """A solver raised, or was late where nothing stands in for it.

    Attributes:
        program: The program that it was given, for replay.
        status: What is known of the outcome.
    """

    def __init__(self, message: str, program: ConvexProgram, status: Status) -> None:
        super().__init__(message)
        self.program = program
        self.status = status


class EmptyHardSet(SafeFilterError, RuntimeError):
    """The user's hard rows contradict each other, and no fallback was given."""


class WrapperOrderError(SafeFilterError, TypeError):
    """Something inside the filter would change the certified action."""


class SceneUnavailable(SafeFilterError, TypeError):
    """The environment offers no scene."""

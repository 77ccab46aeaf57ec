"""Which backends there are, by name; the file that wraps a solver is loaded when the solver is first asked for.

A new backend is one file and one line of `BACKENDS`, or one call of `register_backend` from outside.
"""

from __future__ import annotations

import difflib
import functools
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from safefilter.arguments import require_kind
from safefilter.arrays import positive_number
from safefilter.backends.backend import Backend
from safefilter.errors import BackendNotInstalled, InvalidInput, UnknownBackend

Factory = Callable[[float], Backend]


@dataclass(frozen=True, slots=True)
class Source:
    """Where a backend is defined.

    Attributes:
        module: File that wraps it, loaded on demand.
        maker: What to call there: with a tolerance, or with a solver and a tolerance if it is a family.
        package: What to install if loading the file fails.
    """

    module: str
    maker: str
    package: str


BACKENDS: dict[str, Source] = {
    "planar": Source("safefilter.backends.planar", "Planar", "safefilter"),
    "osqp": Source("safefilter.backends.osqp_backend", "Osqp", "osqp"),
    "clarabel": Source("safefilter.backends.clarabel_backend", "Clarabel", "clarabel"),
}
# Many solvers behind one door, named "family:solver". The file lists them in SOLVERS, and says by
# installed_solvers() which of them are installed.
FAMILIES: dict[str, Source] = {
    "qpsolvers": Source("safefilter.backends.qpsolvers_backend", "Qpsolvers", "qpsolvers"),
    "cvxpy": Source("safefilter.backends.cvxpy_backend", "Cvxpy", "cvxpy"),
}
_registered: dict[str, Factory] = {}


def available_backends() -> tuple[str, ...]:
    """Names of the backends that are installed, sorted; loads all of them to find out."""
    names = list(_registered)
    for name, source in (BACKENDS | FAMILIES).items():
        try:
            module = _load(name, source)
        except BackendNotInstalled:
            continue
        if name in FAMILIES:
            names.extend(f"{name}:{solver}" for solver in module.installed_solvers())
        else:
            names.append(name)
    return tuple(sorted(names))


def register_backend(name: str, factory: Factory) -> None:
    """Add a backend of your own, which then goes by its name everywhere.

    Test it by `safefilter.testing.backend_contract`.

    Args:
        name: A name that is not taken.
        factory: Makes the backend from a tolerance: the accuracy wanted, in the unit of the variables.

    Raises:
        InvalidInput: If the name is taken, or one of the two is something else.
    """
    require_kind(name, "name", str)
    if not callable(factory):
        raise InvalidInput(
            f"factory: expected a function from a tolerance to a backend, got {factory!r}"
        )
    if name in _registered or name in BACKENDS or name.partition(":")[0] in FAMILIES:
        raise InvalidInput(f"name: {name!r} is taken; choose another name for your backend")
    _registered[name] = factory


def make_backend(name: str, *, tolerance: float | None) -> Backend:
    """Make a backend.

    Args:
        name: ``planar``, ``osqp``, ``clarabel``, ``qpsolvers:<solver>``, ``cvxpy:<SOLVER>`` or a registered name.
        tolerance: Accuracy wanted, in the unit of the variables, m/s for robots; above zero. None leaves a solver at
            the accuracy that its authors set, which the filter never does: it is for comparisons.

    Returns:
        A new backend with workspaces of its own.

    Raises:
        UnknownBackend: If there is no such name; the message lists the names that exist.
        BackendNotInstalled: If its package is missing; the message says what to install.
        NotFinite: If the tolerance is NaN or infinite.
        OutOfRange: If the tolerance is not above zero.
        InvalidInput: If it is None for a registered backend, whose factory takes a number.
    """
    accuracy = None if tolerance is None else positive_number(tolerance, "tolerance")
    if not isinstance(name, str):
        raise UnknownBackend(f"backend: expected a name, got {name!r}")
    if name in _registered:
        if accuracy is None:
            raise InvalidInput(f"tolerance: the factory of {name!r} takes a number, got None")
        return _registered[name](accuracy)
    if name in BACKENDS:
        factory: Callable[[float | None], Backend] = getattr(
            _load(name, BACKENDS[name]), BACKENDS[name].maker
        )
        return factory(accuracy)
    family, _, solver = name.partition(":")
    if family in FAMILIES:
        module = _load(name, FAMILIES[family])
        if solver in module.installed_solvers():
            of_family: Callable[[str, float | None], Backend] = getattr(
                module, FAMILIES[family].maker
            )
            return of_family(solver, accuracy)
        if solver in module.SOLVERS:
            raise BackendNotInstalled(_what_to_install(name, module.SOLVERS[solver].package))
    raise UnknownBackend(_what_there_is(name))


def backend_factory(name: str) -> Factory:
    """Factory of a backend that another process can call too; names and errors as in `make_backend`."""
    return _registered.get(name, functools.partial(_make_named, name))


def is_registered(name: str) -> bool:
    """Is this a backend that was added by `register_backend`?"""
    return name in _registered


def _make_named(name: str, tolerance: float) -> Backend:
    return make_backend(name, tolerance=tolerance)


def _load(name: str, source: Source) -> ModuleType:
    try:
        return importlib.import_module(source.module)
    except ImportError as error:
        if (error.name or "").partition(".")[0] == "safefilter":
            raise  # a file of this package that cannot be found is a broken installation, not a missing solver
        raise BackendNotInstalled(_what_to_install(name, source.package)) from error


def _what_to_install(name: str, package: str) -> str:
    return (
        f"backend {name!r} needs the package {package!r}, which cannot be imported; "
        f"run `pip install {package}`"
    )


def _what_there_is(name: str) -> str:
    names = {known.lower(): known for known in available_backends()}
    close = difflib.get_close_matches(name.lower(), names, n=1)
    hint = f" Did you mean {names[close[0]]!r}?" if close else ""
    return f"backend: no backend is called {name!r}.{hint} There are: {', '.join(names.values())}"

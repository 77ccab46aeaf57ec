from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from safefilter.backends import registry
from safefilter.backends.backend import Backend
from safefilter.backends.clarabel_backend import Clarabel
from safefilter.backends.registry import available_backends, make_backend, register_backend
from safefilter.errors import BackendNotInstalled, InvalidInput, OutOfRange, UnknownBackend

# Package, a backend that needs it, and what to install.
NEEDS = {
    "osqp": "osqp",
    "clarabel": "clarabel",
    "qpsolvers": "qpsolvers:daqp",
    "cvxpy": "cvxpy:SCS",
}


@pytest.fixture
def block(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Wrapping files are loaded anew, so that blocked packages are missed, and put back afterwards."""
    for name in [name for name in sys.modules if name.endswith("_backend")]:
        monkeypatch.delitem(sys.modules, name)
    return monkeypatch


def test_available_backends_are_sorted_and_can_all_be_made() -> None:
    names = available_backends()
    assert list(names) == sorted(names)
    assert {"planar", "osqp", "clarabel", "qpsolvers:daqp", "cvxpy:CLARABEL"} <= set(names)
    for name in names:
        assert make_backend(name, tolerance=1e-6).name == name


def test_each_backend_has_workspaces_of_its_own() -> None:
    assert make_backend("osqp", tolerance=1e-6) is not make_backend("osqp", tolerance=1e-6)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("osq", "Did you mean 'osqp'?"),
        ("cvxpy:clarabel", "Did you mean 'cvxpy:CLARABEL'?"),
        ("qpsolvers:dapq", "Did you mean 'qpsolvers:daqp'?"),
        ("qpsolvers", "There are: "),
        ("zzzzzzzz", "There are: "),
    ],
)
def test_unknown_name_lists_the_names_that_exist(name: str, hint: str) -> None:
    with pytest.raises(UnknownBackend) as caught:
        make_backend(name, tolerance=1e-6)
    message = str(caught.value)
    assert message.startswith(f"backend: no backend is called {name!r}.")
    assert hint in message
    assert all(known in message for known in available_backends())


@pytest.mark.parametrize("tolerance", [0.0, -1e-9])
def test_tolerance_must_be_above_zero(tolerance: float) -> None:
    with pytest.raises(OutOfRange, match="tolerance: expected a number above 0"):
        make_backend("osqp", tolerance=tolerance)


@pytest.mark.parametrize("package", NEEDS)
def test_missing_package_is_named_and_the_others_still_work(
    package: str, block: pytest.MonkeyPatch
) -> None:
    block.setitem(sys.modules, package, None)
    with pytest.raises(BackendNotInstalled, match=f"run `pip install {package}`"):
        make_backend(NEEDS[package], tolerance=1e-6)
    available = available_backends()
    assert NEEDS[package] not in available
    for other in NEEDS.values():
        if other != NEEDS[package]:
            assert other in available
            assert make_backend(other, tolerance=1e-6).name == other


@pytest.mark.parametrize(
    ("family", "listed", "solver", "package"),
    [
        ("qpsolvers", "available_solvers", "piqp", "piqp"),
        ("qpsolvers", "available_solvers", "highs", "highspy"),
    ],
)
def test_missing_solver_of_a_family_is_named(
    family: str, listed: str, solver: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = importlib.import_module(family)
    rest = [name for name in getattr(module, listed) if name != solver]
    monkeypatch.setattr(module, listed, rest)
    assert f"{family}:{solver}" not in available_backends()
    with pytest.raises(BackendNotInstalled, match=f"run `pip install {package}`"):
        make_backend(f"{family}:{solver}", tolerance=1e-6)


def test_missing_solver_of_cvxpy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    cvxpy = importlib.import_module("cvxpy")
    monkeypatch.setattr(cvxpy, "installed_solvers", lambda: ["CLARABEL"])
    assert "cvxpy:SCS" not in available_backends()
    with pytest.raises(BackendNotInstalled, match="run `pip install scs`"):
        make_backend("cvxpy:SCS", tolerance=1e-6)


def test_registered_backend_goes_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registered", {})
    asked: list[float] = []

    def factory(tolerance: float) -> Backend:
        asked.append(tolerance)
        return Clarabel(tolerance)

    register_backend("mine", factory)
    assert "mine" in available_backends()
    assert isinstance(make_backend("mine", tolerance=1e-7), Clarabel)
    assert asked == [1e-7]
    with pytest.raises(InvalidInput, match="'mine' is taken"):
        register_backend("mine", factory)


@pytest.mark.parametrize("name", ["planar", "osqp", "qpsolvers:mine", "cvxpy:CLARABEL"])
def test_built_in_names_are_taken(name: str) -> None:
    with pytest.raises(InvalidInput, match="is taken"):
        register_backend(name, Clarabel)


def test_a_broken_file_of_our_own_is_not_called_a_missing_solver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gone = registry.Source("safefilter.backends.gone", "Gone", "gone")
    monkeypatch.setitem(registry.BACKENDS, "gone", gone)
    with pytest.raises(ModuleNotFoundError, match=r"safefilter\.backends\.gone") as caught:
        make_backend("gone", tolerance=1e-6)
    assert not isinstance(caught.value, BackendNotInstalled)


def test_the_registry_loads_no_solver_until_it_is_asked_for() -> None:
    code = (
        "import sys, safefilter.backends.registry as registry\n"
        "packages = {'cvxpy', 'osqp', 'clarabel', 'qpsolvers'}\n"
        "print(sorted(packages & set(sys.modules)))\n"
        "registry.make_backend('clarabel', tolerance=1e-6)\n"
        "print(sorted(packages & set(sys.modules)))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.splitlines() == ["[]", "['clarabel']"]

"""The tree of errors is the one drawn in the module's docstring."""

from __future__ import annotations

import copy
import inspect
import pickle

import numpy as np
import pytest

from safefilter import errors
from safefilter.backends.backend import Status
from safefilter.programs.convex_program import ConvexProgram

BUILTINS = {
    errors.InvalidInput: ValueError,
    errors.ShapeError: ValueError,
    errors.NotFinite: ValueError,
    errors.OutOfRange: ValueError,
    errors.NotCooperative: ValueError,
    errors.UnknownBackend: ValueError,
    errors.BackendNotInstalled: ImportError,
    errors.UnsupportedProgram: ValueError,
    errors.BackendFailed: RuntimeError,
    errors.EmptyHardSet: RuntimeError,
    errors.WrapperOrderError: TypeError,
    errors.SceneUnavailable: TypeError,
}
DEFINED = {kind for _, kind in inspect.getmembers(errors, inspect.isclass)} - {
    errors.SafeFilterError
}


def drawn_tree() -> dict[str, tuple[int, str]]:
    """Name of each error in the drawing: its depth, and the builtin beside it."""
    tree = {}
    for line in (errors.__doc__ or "").splitlines():
        head, mark, rest = line.partition("── ")
        if mark:
            name, _, beside = rest.partition(" ")
            builtin = beside.split(")")[0].removeprefix("(") if beside.startswith("(") else ""
            tree[name] = (1 if head.strip() in {"├", "└"} else 2, builtin)
    return tree


def test_every_error_is_listed_here() -> None:
    assert set(BUILTINS) == DEFINED


@pytest.mark.parametrize(("kind", "builtin"), BUILTINS.items())
def test_errors_are_also_the_builtin_they_specialise(
    kind: type[Exception], builtin: type[Exception]
) -> None:
    assert issubclass(kind, errors.SafeFilterError)
    assert issubclass(kind, builtin)


def test_the_drawing_shows_every_error_in_its_place() -> None:
    drawn = drawn_tree()
    assert set(drawn) == {kind.__name__ for kind in DEFINED}
    for kind in DEFINED:
        depth, builtin = drawn[kind.__name__]
        assert depth == (2 if errors.InvalidInput in kind.__mro__[1:] else 1), kind
        if depth == 1:
            assert builtin == BUILTINS[kind].__name__
            assert BUILTINS[kind] in kind.__bases__, kind


def test_a_failed_backend_leaves_what_is_needed_for_a_replay() -> None:
    program = ConvexProgram(P=np.eye(1), q=np.ones(1), G=np.empty((0, 1)), h=np.empty(0))
    error = errors.BackendFailed("osqp raised", program, Status.FAILED)
    assert str(error) == "osqp raised"
    assert error.program is program
    assert error.status is Status.FAILED


def test_a_missing_package_is_caught_as_an_import_error() -> None:
    with pytest.raises(ImportError, match="pip install"):
        raise errors.BackendNotInstalled("osqp is missing: pip install osqp")


@pytest.mark.parametrize("kind", sorted(DEFINED - {errors.BackendFailed}, key=str))
def test_errors_cross_processes(kind: type[Exception]) -> None:
    again = pickle.loads(pickle.dumps(kind("what was given")))
    assert type(again) is kind
    assert str(again) == "what was given"
    assert str(copy.copy(again)) == "what was given"

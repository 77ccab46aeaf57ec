"""Arguments that are no arrays: usable ones come back as what they are, others are named."""

from pathlib import Path

import numpy as np
import pytest

from safefilter.arguments import (
    file_path,
    real_number,
    require_flag,
    require_kind,
    require_kinds,
    require_mapping,
    require_option,
    whole_number,
)
from safefilter.errors import InvalidInput, OutOfRange, ShapeError


@pytest.mark.parametrize("value", [1.5, 2, np.float32(0.5), np.array(3), True, 2**70, np.inf])
def test_numbers_of_any_kind_are_floats(value: object) -> None:
    number = real_number(value, "speed")
    assert type(number) is float
    assert number == value


@pytest.mark.parametrize("value", [None, "1", 1j, [], [1.0], np.ones(2), object(), 10**400])
def test_what_is_no_number_is_named(value: object) -> None:
    with pytest.raises(ShapeError, match="speed: expected a number"):
        real_number(value, "speed")


def test_whole_numbers_are_integers_from_a_bound_up() -> None:
    assert whole_number(np.int8(3), "sides", 3) == 3
    with pytest.raises(OutOfRange, match="sides: expected at least 3, got 2"):
        whole_number(2, "sides", 3)
    for value in (3.0, True, "3", None, np.ones(1)):
        with pytest.raises(InvalidInput, match="sides: expected an integer, got"):
            whole_number(value, "sides", 0)


def test_options_are_names() -> None:
    require_option("left", "side", ("left", "right"))
    for value in ("up", None, ["left"], np.array(["left", "left"])):
        with pytest.raises(InvalidInput, match="side: expected one of left, right, got"):
            require_option(value, "side", ("left", "right"))


def test_objects_are_of_a_kind() -> None:
    assert require_kind(7, "number", int) == 7
    with pytest.raises(InvalidInput, match="number: expected a int, got str"):
        require_kind("7", "number", int)


def test_flags_are_true_or_false() -> None:
    assert require_flag(np.bool_(True), "hard") is True
    for value in (1, None, np.zeros(2, np.bool_)):
        with pytest.raises(InvalidInput, match="hard: expected True or False"):
            require_flag(value, "hard")


def test_series_of_a_kind() -> None:
    assert require_kinds(iter([1, 2]), "counts", int) == (1, 2)
    with pytest.raises(InvalidInput, match=r"counts\[1\]: expected a int, got str"):
        require_kinds([1, "2"], "counts", int)
    for value in ("12", b"12", np.ones(2), 7, None):
        with pytest.raises(InvalidInput, match="counts: expected a list of int, got"):
            require_kinds(value, "counts", int)


def test_mappings() -> None:
    assert require_mapping({1: 2}, "robots") == {1: 2}
    with pytest.raises(InvalidInput, match="robots: expected a mapping, got list"):
        require_mapping([1], "robots")


def test_names_of_files() -> None:
    assert file_path("a/b", "path") == file_path(Path("a/b"), "path") == Path("a/b")
    for value in (7, None, b"a", "a\0b", "x" * 256, "\ud800"):
        with pytest.raises(
            InvalidInput, match=r"path: (expected the name of a file|no file can be)"
        ):
            file_path(value, "path")

"""What `import safefilter` offers, and that it is what its pages say."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import safefilter as sf
from safefilter import errors

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", sf.__all__)
def test_every_public_name_is_there_and_documented(name: str) -> None:
    thing = getattr(sf, name)
    assert (inspect.getdoc(thing) or "").strip()
    if inspect.isclass(thing) or inspect.isfunction(thing):
        assert thing.__module__.startswith("safefilter.")


def test_star_import_brings_the_public_names_and_nothing_else() -> None:
    code = "from safefilter import *; print(*sorted(set(dir()) - {'__builtins__'}))"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    names = [name for name in result.stdout.split() if not name.startswith("__")]
    assert names == sf.__all__


def test_the_version_is_that_of_the_project() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    match = re.search(r'^version = "(.+)"$', project, re.MULTILINE)
    assert match
    assert match[1] == sf.__version__


def test_every_error_is_a_safefilter_error_and_a_builtin_one() -> None:
    found = [
        thing
        for thing in vars(errors).values()
        if inspect.isclass(thing) and issubclass(thing, Exception)
    ]
    assert len(found) >= 10
    for error in found:
        assert issubclass(error, sf.SafeFilterError)
        builtin = {base for base in error.__mro__ if base.__module__ == "builtins"}
        assert error is sf.SafeFilterError or builtin - {Exception, BaseException, object}
        assert error.__name__ in (errors.__doc__ or "")


def test_types_are_shipped() -> None:
    assert (Path(inspect.getfile(sf)).parent / "py.typed").exists()

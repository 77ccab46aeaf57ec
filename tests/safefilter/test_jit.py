"""Compiled formulas are the ones in the sources: never those of yesterday, never others in Python."""

from __future__ import annotations

import importlib.util
import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.caching import CompileResultCacheImpl

import safefilter
from safefilter.arrays import FloatArray
from safefilter.jit import array_formula, formula, kernel, package_of, source_digest, source_of

PACKAGE = Path(safefilter.__file__).parent
numba_config: Any = numba.config  # numba's types know no settings
compiled_only = pytest.mark.skipif(
    bool(numba_config.DISABLE_JIT), reason="there is nothing compiled with NUMBA_DISABLE_JIT=1"
)

# Head-on: the offset of a half-plane, made by a kernel of one file from formulas of others.
SCRIPT = """
import numpy as np
import safefilter as sf

scene = sf.Scene.from_world([[0.0, 0.0], [4.0, 0.0]], [[0.875, 0.0], [-0.875, 0.0]], 0.5)
rows = sf.PriorityORCA(2.0).half_spaces(scene, np.zeros((2, 2)), np.arange(2))
print(rows.offsets[0, 0])
"""
FORMULA = "return combined_radius / horizon - w_length"
CHANGED = "return combined_radius / horizon - w_length + 1.0"

KERNEL = "from safefilter.jit import kernel\n\n@kernel\ndef one() -> int:\n    return 1\n"


def plus_one(x: float) -> float:
    return x + 1


def given_back(values: FloatArray) -> FloatArray:
    return values


def with_first_of(values: FloatArray) -> tuple[float, FloatArray]:
    return 1.0, values[:1]


def twice(values: FloatArray) -> FloatArray:
    return 2.0 * values


def copy_of_package(folder: Path) -> Path:
    return shutil.copytree(
        PACKAGE, folder / "safefilter", ignore=shutil.ignore_patterns("__pycache__")
    )


def loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("jit_of_a_copy", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def digest_of(package: Path) -> str:
    digest: str = loaded(package / "jit.py").source_digest()
    return digest


def test_digest_is_that_of_the_bytes_and_not_of_the_place(tmp_path: Path) -> None:
    assert digest_of(copy_of_package(tmp_path)) == source_digest()


@pytest.mark.parametrize(
    "name", ["constraints/velocity_obstacle.py", "jit.py", "__init__.py", "programs/__init__.py"]
)
def test_digest_changes_with_every_file(tmp_path: Path, name: str) -> None:
    package = copy_of_package(tmp_path)
    with (package / name).open("a", encoding="utf-8") as file:
        file.write("# another byte\n")
    assert digest_of(package) != source_digest()


def test_digest_changes_with_a_new_file(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path)
    (package / "constraints" / "another.py").write_text("# another file\n", encoding="utf-8")
    assert digest_of(package) != source_digest()


def test_the_package_of_a_file_is_the_outermost_one(tmp_path: Path) -> None:
    inner = tmp_path / "outer" / "inner"
    inner.mkdir(parents=True)
    for folder in (inner, inner.parent):
        (folder / "__init__.py").touch()
    assert package_of(inner / "kernel.py") == inner.parent
    assert package_of(PACKAGE / "batch" / "decide.py") == PACKAGE
    assert package_of(tmp_path / "script.py") == PACKAGE


@compiled_only
def test_kernels_of_another_package_are_keyed_by_its_sources_too(tmp_path: Path) -> None:
    (tmp_path / "world").mkdir()
    (tmp_path / "world" / "__init__.py").touch()
    keys = []
    for number in range(2):
        (tmp_path / "world" / "one.py").write_text(KERNEL, encoding="utf-8")
        (tmp_path / "world" / "formula.py").write_text(f"# {number}\n", encoding="utf-8")
        source_digest.cache_clear()
        cache: Any = loaded(tmp_path / "world" / "one.py").one._cache
        keys.append(cache._index_key((), numba.core.registry.cpu_target.target_context.codegen()))
    assert keys[0] != keys[1]


@pytest.mark.stress
def test_a_cached_kernel_does_not_run_the_formula_of_yesterday(tmp_path: Path) -> None:
    package, cache = copy_of_package(tmp_path), tmp_path / "cache"

    def run() -> float:
        environment = {
            **os.environ,
            "PYTHONPATH": str(tmp_path),
            "NUMBA_CACHE_DIR": str(cache),
            "NUMBA_DISABLE_JIT": "0",
        }
        result = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stderr
        return float(result.stdout)

    def machine_code() -> set[Path]:
        return {path.relative_to(cache) for path in cache.rglob("*.nbc")}

    before = run()
    compiled = machine_code()
    assert any("_orca_rows" in path.name for path in compiled)
    assert run() == before
    assert machine_code() == compiled, "the second process must not compile again"
    # The kernel lives in priority_orca.py; only a formula that it inlines changes.
    source = package / "constraints" / "velocity_obstacle.py"
    text = source.read_text(encoding="utf-8")
    assert text.count(FORMULA) == 1
    source.write_text(text.replace(FORMULA, CHANGED), encoding="utf-8")
    assert run() == before + 0.5  # half of a change that is larger by 1 m/s
    source.write_text(text, encoding="utf-8")
    assert run() == before


@pytest.mark.parametrize("compiled", [formula(plus_one), array_formula(plus_one), kernel(plus_one)])
def test_compiled_functions_do_what_their_source_does(compiled: Callable[[float], float]) -> None:
    assert compiled(0.5) == plus_one(0.5) == 1.5


def test_the_source_of_a_compiled_function_takes_other_numbers() -> None:
    assert source_of(formula(plus_one))(Fraction(1, 3)) == Fraction(4, 3)  # type: ignore[arg-type]  # exact numbers
    assert source_of(plus_one) is plus_one


def test_functions_that_make_arrays_may_return_them() -> None:
    for compiled in (array_formula(twice), kernel(twice)):
        assert compiled(np.arange(3.0)).tolist() == [0.0, 2.0, 4.0]


@compiled_only
@pytest.mark.parametrize("plain", [given_back, with_first_of])
def test_a_formula_that_returns_an_array_is_refused(
    plain: Callable[[FloatArray], object],
) -> None:
    # Its memory would be freed while others use it.
    with pytest.raises(TypeError) as caught:
        formula(plain)(np.arange(3.0))
    assert str(caught.value) == f"{plain.__name__} returns an array: make it an array_formula"


@compiled_only
def test_a_formula_that_makes_an_array_is_refused() -> None:
    with pytest.raises(numba.errors.TypingError):
        formula(twice)(np.arange(3.0))


@compiled_only
def test_division_by_zero_follows_ieee_as_in_numpy() -> None:
    def inverse(x: float) -> float:
        return 1.0 / x

    for compiled in (formula(inverse), kernel(inverse)):
        assert compiled(0.0) == np.inf


@compiled_only
def test_kernels_work_where_no_folder_can_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    # numba looks for a folder to write to in these places, and raises if there is none.
    monkeypatch.setattr(CompileResultCacheImpl, "_locator_classes", [])
    assert kernel(plus_one)(1.0) == 2.0


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where numba keeps what is compiled within the test."""
    folder = tmp_path / "cache"
    monkeypatch.setattr(numba_config, "CACHE_DIR", str(folder))
    return folder


@compiled_only
@pytest.mark.parametrize("content", [b"", b"no pickle", pickle.dumps("0.0")[:-3]])
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_cache_that_cannot_be_read_is_made_anew(
    tmp_path: Path, cache: Path, suffix: str, content: bytes
) -> None:
    (tmp_path / "one.py").write_text(KERNEL, encoding="utf-8")
    assert loaded(tmp_path / "one.py").one() == 1
    (file,) = cache.rglob(f"*.{suffix}")
    file.write_bytes(content)
    # Once to find that out, and once more from the cache that was made then.
    for hits in (0, 1):
        again = loaded(tmp_path / "one.py").one
        assert again() == 1
        assert sum(again.stats.cache_hits.values()) == hits


@compiled_only
def test_a_cache_of_types_that_have_moved_is_made_anew(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "one.py").write_text(KERNEL, encoding="utf-8")
    assert loaded(tmp_path / "one.py").one() == 1
    (index,) = cache.rglob("*.nbi")
    # As an earlier version may have left it: numba reads its own version first, then the rest.
    index.write_bytes(pickle.dumps(numba.__version__) + b"cnowhere\nMoved\n.")
    assert loaded(tmp_path / "one.py").one() == 1


@compiled_only
def test_an_index_that_is_cut_off_is_made_anew(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "one.py").write_text(KERNEL, encoding="utf-8")
    assert loaded(tmp_path / "one.py").one() == 1
    (index,) = cache.rglob("*.nbi")
    index.write_bytes(index.read_bytes()[:-5])
    assert loaded(tmp_path / "one.py").one() == 1


@compiled_only
def test_code_that_was_left_for_other_arguments_is_not_run(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = KERNEL.replace("one() -> int", "one(x)").replace("return 1", "return x + 1")
    (tmp_path / "one.py").write_text(source, encoding="utf-8")
    assert loaded(tmp_path / "one.py").one(1.5) == 2.5
    (index,) = cache.rglob("*.nbi")
    index.write_bytes(b"")

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    again = loaded(tmp_path / "one.py").one
    monkeypatch.setattr(again._cache._cache_file, "_save_data", killed)
    # The index says by now where the code for integers is, and the code for real numbers lies there.
    with pytest.raises(KeyboardInterrupt):
        again(1)
    assert len(list(cache.rglob("*.nbc"))) == 1
    last = loaded(tmp_path / "one.py").one
    assert type(last(1)) is int
    assert not last.stats.cache_hits


@compiled_only
@pytest.mark.usefixtures("cache")
def test_a_cache_that_may_not_be_read_is_an_error_and_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "one.py").write_text(KERNEL, encoding="utf-8")
    assert loaded(tmp_path / "one.py").one() == 1

    def refused(*_: object) -> None:
        raise PermissionError

    one = loaded(tmp_path / "one.py").one
    monkeypatch.setattr(one._cache._cache_file, "load", refused)
    with pytest.raises(PermissionError):
        one()
    again = loaded(tmp_path / "one.py").one
    assert again() == 1
    assert sum(again.stats.cache_hits.values()) == 1

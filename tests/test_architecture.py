"""The tree keeps its rules: sizes, names, tests beside sources, dependencies where they belong.

Who may import whom is checked by import-linter, see `[tool.importlinter]` in pyproject.toml.
"""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ["safefilter", "envs", "policies", "proofs", "assurance"]
FOLDERS = [*PACKAGES, "benchmarks", "examples", "tests"]

MAX_LINES = 400
MOST_LINES = 250
VAGUE_NAMES = {
    "utils",
    "util",
    "helpers",
    "helper",
    "misc",
    "common",
    "core",
    "base",
    "manager",
    "data",
}

# Files that are tested through another one, because alone they do nothing that could be wrong.
TESTED_ELSEWHERE: dict[str, str] = {
    "safefilter/differentiable/found.py": "test_answer",
    "safefilter/differentiable/searched.py": "test_planar_search",
    "safefilter/constraints/constraint.py": "test_user_rows",
    "safefilter/scene_arguments.py": "test_scene",
    "safefilter/scene_arrays.py": "test_scene",
    "safefilter/robot_decisions.py": "test_safety_filter",
    "safefilter/testing/known_programs.py": "test_backend_contract",
    "safefilter/testing/program_strategies.py": "test_certificate",
    "safefilter/batch/decide.py": "test_safety_filter_batch",
    "safefilter/batch/decide_in_space.py": "test_safety_filter_in_space",
    "safefilter/batch/decide_worlds.py": "test_worlds",
    "safefilter/batch/kernels.py": "test_safety_filter_in_space",
    "safefilter/batch/program.py": "test_safety_filter_batch",
    "safefilter/batch/program_in_space.py": "test_safety_filter_in_space",
    "safefilter/batch/robots.py": "test_safety_filter",
    "safefilter/batch/rows.py": "test_safety_filter_rows",
    "safefilter/batch/rows_in_space.py": "test_safety_filter_in_space",
}

# Packages that `import safefilter` must work without; the file that needs one is imported on request.
ON_REQUEST = [
    "clarabel", "cvxpy", "hypothesis", "matplotlib", "osqp", "pettingzoo", "qpsolvers", "torch",
]  # fmt: skip

# Names on PyPI that differ from the names imported.
DISTRIBUTIONS = {
    "PIL": "pillow",
    "irsim": "ir-sim",
    "pygame": "pygame-ce",
    "stable_baselines3": "stable-baselines3",
    "yaml": "pyyaml",
    "z3": "z3-solver",
}
EXTRA_OF_FOLDER = {
    "safefilter": ["compare", "demo", "learn", "qpbenchmark", "testing"],
    "envs": ["demo", "learn"],
    "policies": ["demo", "learn"],
    "proofs": ["demo", "dev"],
    "assurance": ["demo", "dev", "fuzz", "learn", "testing"],
    "benchmarks": ["bench", "demo", "dev", "learn"],
    "examples": ["demo", "dev", "learn", "testing"],
    "tests": ["demo", "dev", "learn", "testing"],
}


def sources(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def all_sources() -> list[Path]:
    return [path for folder in FOLDERS for path in sources(folder)]


def num_lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def project() -> dict[str, Any]:
    table: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return table


def imported_packages(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]


def requirements(extra: str | None) -> set[str]:
    metadata = project()["project"]
    lines = metadata["optional-dependencies"][extra] if extra else metadata["dependencies"]
    return {match[0] for line in lines if (match := re.match(r"[\w-]+", line))}


def exported_names(tree: ast.Module) -> list[str] | None:
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names: list[str] = ast.literal_eval(node.value)
            return names
    return None


def bound_names(tree: ast.Module) -> set[str]:
    names: set[str] = set()
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names.update(alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names.update(ast.unparse(target) for target in node.targets)
        elif isinstance(node, ast.AnnAssign):
            names.add(ast.unparse(node.target))
    return names


def run_python(code: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_no_file_is_too_long_to_read_in_one_go() -> None:
    assert {
        name_of(path): num_lines(path) for path in all_sources() if num_lines(path) > MAX_LINES
    } == {}


def test_nine_files_in_ten_are_short() -> None:
    files = [path for path in all_sources() if not name_of(path).startswith("tests/")]
    long = [name_of(path) for path in files if num_lines(path) > MOST_LINES]
    assert len(long) <= len(files) / 10, long


def test_file_names_say_what_is_inside() -> None:
    assert [name_of(path) for path in all_sources() if path.stem in VAGUE_NAMES] == []


def test_tests_are_modules_without_packages() -> None:
    assert [name_of(path) for path in sources("tests") if path.name == "__init__.py"] == []


def test_every_file_of_safefilter_has_its_test_file() -> None:
    tests = {path.stem for path in sources("tests/safefilter")}
    names = [name_of(path) for path in sources("safefilter") if not path.stem.startswith("__")]
    expected = {name: TESTED_ELSEWHERE.get(name, f"test_{Path(name).stem}") for name in names}
    assert {name: test for name, test in expected.items() if test not in tests} == {}
    assert set(TESTED_ELSEWHERE) <= set(names), "a file in TESTED_ELSEWHERE is gone"


@pytest.mark.parametrize("package", [name for name in PACKAGES if (ROOT / name).exists()])
def test_exported_names_exist_and_are_sorted(package: str) -> None:
    for path in sources(package):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        exported = exported_names(tree)
        if exported is not None:
            # That they are sorted is for ruff to say (RUF022).
            assert len(exported) == len(set(exported)), name_of(path)
            assert set(exported) <= bound_names(tree), name_of(path)


def test_safefilter_says_what_is_public() -> None:
    assert exported_names(ast.parse((ROOT / "safefilter/__init__.py").read_text(encoding="utf-8")))


def test_import_linter_knows_every_package() -> None:
    existing = [name for name in PACKAGES if (ROOT / name / "__init__.py").exists()]
    assert project()["tool"]["importlinter"]["root_packages"] == existing


def test_mypy_checks_every_folder() -> None:
    existing = [name for name in FOLDERS if sources(name)]
    assert project()["tool"]["mypy"]["files"] == existing


@pytest.mark.parametrize("folder", [name for name in FOLDERS if (ROOT / name).exists()])
def test_everything_imported_is_declared(folder: str) -> None:
    declared = requirements(None).union(*map(requirements, EXTRA_OF_FOLDER[folder]))
    known = {*sys.stdlib_module_names, *FOLDERS}
    undeclared = {
        package: name_of(path)
        for path in sources(folder)
        for package in imported_packages(path)
        if package not in known and DISTRIBUTIONS.get(package, package) not in declared
    }
    assert undeclared == {}


def test_import_loads_nothing_that_is_needed_on_request_only() -> None:
    code = f"import sys, safefilter; print(*sorted(set(sys.modules) & {set(ON_REQUEST)!r}))"
    assert run_python(code).split() == []


@pytest.mark.parametrize("package", ON_REQUEST)
def test_import_works_without(package: str) -> None:
    # A finder that refuses the package, as on a machine that lacks it. (None in sys.modules would do as much, but
    # scipy looks into what it finds there for torch.)
    code = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == {package!r}:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Absent())
import safefilter as sf
print(*sf.available_backends())
"""
    assert "planar" in run_python(code).split()


def test_extras_that_are_named_exist() -> None:
    texts = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *sources("safefilter"), *sources("envs")]
    extras = set(project()["project"]["optional-dependencies"])
    named = {
        extra: name_of(path)
        for path in texts
        for group in re.findall(r"safefilter\[([\w,-]+)\]", path.read_text(encoding="utf-8"))
        for extra in group.split(",")
    }
    assert {extra: path for extra, path in named.items() if extra not in extras} == {}


def test_readme_names_every_extra() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    extras = set(project()["project"]["optional-dependencies"])
    assert {
        extra for extra in extras if f"[{extra}]" not in readme and f"`{extra}`" not in readme
    } == set()

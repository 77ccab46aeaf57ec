"""No public name is forgotten: malformed values are handed to it, or it is said why not; readers of files alike."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

from assurance.file_loaders import FILE_LOADERS
from assurance.filter_entries import FILTER_ENTRIES
from assurance.loop_entries import LOOP_ENTRIES
from assurance.public_names import ENTRY_OF, FUZZED, NOT_FUZZED

ROOT = Path(__file__).parents[2]
MODULES = sorted(FUZZED.keys() | NOT_FUZZED.keys())
# Loaded on request, so no part of ``import *``.
ON_REQUEST = {"safefilter.wrappers": {"SafeParallelEnv"}}
OPENING = {
    "read_text", "read_bytes", "open", "read_bounded", "require_bounded", "read_limited", "safe_load", "load",
    "from_file", "InferenceSession",
}  # fmt: skip
# Files that read files, and which loader hands damaged ones to them; or what it is that they read.
READERS = {
    "safefilter/bounded_file.py": "under all of them",
    "safefilter/comparison/problem_file.py": "problems",
    "safefilter/comparison/recording.py": "appends to its own file",
    "safefilter/comparison/files.py": "writes only",
    "safefilter/comparison/machine.py": "/proc/cpuinfo, for a name of the machine",
    "safefilter/jit.py": "the package's own sources",
    "safefilter/backends/cvxpy_backend.py": "no file: loads a program into its workspace",
    "envs/recording_file.py": "recording",
    "envs/scenarios/yaml_lines.py": "layout",
    "policies/atomic_file.py": "writes only",
    "policies/code_digest.py": "the package's own sources",
    "policies/curves.py": "learning curve",
    "policies/evaluate.py": "the page that it renews, as text",
    "policies/foreign_policy.py": "policy of somebody else",
    "policies/onnx_policy.py": "exported policy",
    "policies/checkpoint.py": "weights",
    "policies/ship.py": "rows of the table",
    "policies/table_cell.py": "cell of the table",
    "policies/tensor_file.py": "checkpoint of a training",
    "policies/torchscript_export.py": "an archive that it has written itself just before; it says so",
}


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_is_fuzzed_or_it_is_said_why_not(module: str) -> None:
    public = set(import_module(module).__all__) | ON_REQUEST.get(module, set())
    fuzzed, others = set(FUZZED.get(module, ())), NOT_FUZZED.get(module, {})
    assert fuzzed.isdisjoint(others)
    assert fuzzed | set(others) == public
    entries = FILTER_ENTRIES | LOOP_ENTRIES
    assert {name for name in fuzzed if ENTRY_OF.get(name, name) not in entries} == set()


def test_every_package_that_says_what_is_public_is_looked_at() -> None:
    offering = {
        ".".join(path.parent.relative_to(ROOT).parts)
        for folder in ("safefilter", "envs", "policies")
        for path in (ROOT / folder).rglob("__init__.py")
        if "__all__" in path.read_text(encoding="utf-8")
    }
    assert offering == set(MODULES)


def test_every_file_that_reads_files_is_known_and_fuzzed() -> None:
    loaders = {loader.name for loader in FILE_LOADERS}
    found = set()
    for folder in ("safefilter", "envs", "policies"):
        for path in (ROOT / folder).rglob("*.py"):
            calls = [
                node.func.attr
                if isinstance(node.func, ast.Attribute)
                else getattr(node.func, "id", "")
                for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                if isinstance(node, ast.Call)
            ]
            if OPENING.intersection(calls):
                found.add(path.relative_to(ROOT).as_posix())
    assert found == set(READERS), found ^ set(READERS)
    assert loaders - set(READERS.values()) == {
        "card of weights",
        "settings of a training",
    }

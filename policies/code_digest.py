"""A digest of all code that a module runs: of its own file and of everything of this project that it imports.

What is kept from one run to the next is kept under it, so that nothing old is taken for the result of new code; and
changes of code that has nothing to do with it throw nothing away.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("safefilter", "envs", "policies", "assurance")


@functools.cache
def code_digest(module: str) -> str:
    """Digest of the source of a module and of what it imports, here and there, in hexadecimal.

    Whatever of a package is imported, its ``__init__`` runs, and counts too.

    Args:
        module: Full name, such as ``policies.table_cell``.
    """
    digest = hashlib.sha256()
    for name, path in sorted(imported_files(module).items()):
        digest.update(f"{name}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def imported_files(module: str) -> dict[str, Path]:
    """Source files by module: of the module itself and of everything of this project that it imports."""
    found: dict[str, Path] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or name.partition(".")[0] not in PACKAGES:
            continue
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:
            continue
        found[name] = Path(spec.origin)
        waiting += _imports(found[name])
        waiting += [name.rpartition(".")[0]]
    return found


def _imports(path: Path) -> Iterator[str]:
    """Names that a file imports, wherever in it; of ``from a import b`` both ``a`` and ``a.b``, if that is a module."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                if name.partition(".")[0] in PACKAGES and _is_module(name):
                    yield name


def _is_module(name: str) -> bool:
    parent = importlib.util.find_spec(name.rpartition(".")[0])
    if parent is None or parent.submodule_search_locations is None:
        return False
    return importlib.util.find_spec(name) is not None

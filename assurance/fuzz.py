"""Look for files that crash their readers, led by coverage: ``python -m assurance.fuzz --seconds 600``.

Each kind of `assurance.file_loaders` gets an equal part of the time, in a process of its own, once as bytes and, where
a checksum would stop those, once as JSON behind a right one. atheris (extra `fuzz`) changes the files, and keeps those
that reach new lines in ``out/fuzz/``, so that the next run goes on from there. What comes out must be an error of ours
or what can be used; a file for which it is something else is left in ``out/fuzz/`` too, and the command ends with 1. It
should then become an example in ``tests/integration/test_damaged_files.py``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FOUND = ROOT / "out" / "fuzz"
PACKAGES = ("safefilter", "envs", "policies", "yaml", "json")
"""What coverage is counted of. Kernels are interpreted: no reader needs them."""
INTERPRETED = {"NUMBA_DISABLE_JIT": "1"}
MOST_BYTES = 20_000
"""Of a file that is tried."""
MOST_MEMORY = 4096
"""In MB: of a process that needs more, an input is to blame."""
PATIENCE = 20
"""In s: an input that takes longer hangs."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 1 if a reader failed, 2 without atheris."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = argparse.ArgumentParser(prog="python -m assurance.fuzz", description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=600.0, help="for all kinds of files together"
    )
    parser.add_argument("--only", default="", help="kinds whose name holds this")
    parser.add_argument("--kind", default="", help=argparse.SUPPRESS)
    options = parser.parse_args(given)
    if importlib.util.find_spec("atheris") is None:
        sys.stdout.write("atheris is not installed: pip install 'safefilter[fuzz]'\n")
        return 2
    if options.kind:
        _fuzz(options.kind, options.seconds)
    kinds = [kind for kind in targets() if options.only in kind]
    worst = 0
    for kind in kinds:
        seconds = max(1, int(options.seconds / len(kinds)))
        command = [
            sys.executable,
            "-m",
            "assurance.fuzz",
            "--kind",
            kind,
            "--seconds",
            str(seconds),
        ]
        sys.stdout.write(f"{kind}: {seconds} s\n")
        sys.stdout.flush()
        run = subprocess.run(command, env={**os.environ, **INTERPRETED}, cwd=ROOT, check=False)
        if run.returncode != 0:
            sys.stdout.write(f"{kind}: FAILED, see above and {FOUND}\n")
            worst = 1
    return worst


def targets() -> list[str]:
    """Kinds of files; those with a checksum, and JSON behind it, also as that JSON."""
    from assurance.file_loaders import FILE_LOADERS  # noqa: PLC0415  # counted from `_fuzz` on
    from assurance.file_trees import FILE_TREES  # noqa: PLC0415

    sealed = [loader.name for loader in FILE_LOADERS if loader.is_sealed]
    behind = [f"{name}, behind its checksum" for name in sealed if name in FILE_TREES]
    return [*(loader.name for loader in FILE_LOADERS), *behind]


def reader(kind: str, folder: Path) -> tuple[Callable[[bytes], object], list[bytes]]:
    """What takes a content, and contents to begin with.

    Args:
        kind: One of `targets`.
        folder: Where it is read from.

    Returns:
        A function that raises if the reader of these files does anything but refuse or read.
    """
    from assurance.file_damage import FOREIGN  # noqa: PLC0415
    from assurance.file_loaders import FILE_LOADERS  # noqa: PLC0415
    from assurance.file_trees import FILE_TREES  # noqa: PLC0415
    from safefilter.errors import SafeFilterError  # noqa: PLC0415

    name, _, behind = kind.partition(", ")
    (loader,) = [each for each in FILE_LOADERS if each.name == name]
    loader.write(folder)
    path = folder / loader.file
    whole, usual = path.read_bytes(), loader.load(folder)

    def try_bytes(content: bytes) -> None:
        path.write_bytes(content)
        try:
            read = loader.load(folder)
        except SafeFilterError:
            return
        if loader.is_sealed and not behind and content != whole and read != usual:
            raise AssertionError(f"{kind}: something else was read, and nobody noticed")

    def try_json(content: bytes) -> None:
        try:
            tree = json.loads(content)
            made = FILE_TREES[name].made(whole, tree)
        except (ValueError, RecursionError):
            return
        try_bytes(made)

    if behind:
        return try_json, [json.dumps(FILE_TREES[name].taken(whole)).encode()]
    return try_bytes, [
        whole,
        *(content for content in FOREIGN.values() if len(content) < MOST_BYTES),
    ]


def _fuzz(kind: str, seconds: float) -> None:
    """Fuzz one kind; does not return."""
    atheris: Any = importlib.import_module("atheris")
    with atheris.instrument_imports(include=list(PACKAGES)):
        importlib.import_module("assurance.file_loaders")
    with tempfile.TemporaryDirectory() as folder:
        try_content, seeds = reader(kind, Path(folder))
        corpus = FOUND / kind.replace(" ", "_").replace(",", "")
        corpus.mkdir(parents=True, exist_ok=True)
        for number, content in enumerate(seeds):
            (corpus / f"seed_{number}").write_bytes(content)
        limits = {
            "max_total_time": int(seconds),
            "max_len": MOST_BYTES,
            "rss_limit_mb": MOST_MEMORY,
            "timeout": PATIENCE,
            "artifact_prefix": f"{corpus}.",
            "verbosity": 0,
            "print_final_stats": 1,
        }
        flags = [f"-{name}={value}" for name, value in limits.items()]
        atheris.Setup([sys.argv[0], *flags, str(corpus)], try_content)
        atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())

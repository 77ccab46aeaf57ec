"""Numba, as this package uses it: typed decorators, and a cache that cannot run stale formulas.

Numba keys its disk cache by the file of the compiled function alone. Ours inline formulas from other files, so a
cached kernel would go on running the old formula after an upgrade. Here the key also holds a digest of every source
file of this package, and of the package that the kernel is in.

Functions marked `formula` are plain arithmetic: numba compiles them, `proofs` calls their source on z3 terms and
tests call it on `Fraction`; see `source_of`.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

FunctionT = TypeVar("FunctionT", bound=Callable[..., object])
# numba's own stubs leave out some of what is used here, and older versions have none.
_njit: Any = numba.njit
_config: Any = numba.config
_Cache: Any = FunctionCache


PACKAGE = Path(__file__).parent


@functools.cache
def source_digest(folder: Path = PACKAGE) -> str:
    """Digest of every source file in a folder; by default those of this package."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def package_of(file: Path) -> Path:
    """Folder of the outermost package that a source file is in; of this one for a file that is in none."""
    if not (file.parent / "__init__.py").exists():
        return PACKAGE
    folder = file.parent
    while (folder.parent / "__init__.py").exists():
        folder = folder.parent
    return folder


class _WholePackageCache(_Cache):  # type: ignore[misc]  # of any type, see above
    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        self._package = package_of(Path(function.__code__.co_filename))

    def _index_key(self, sig: object, codegen: object) -> tuple[object, ...]:
        digests = source_digest(), source_digest(self._package)
        return (*super()._index_key(sig, codegen), *digests)

    def _load_overload(self, sig: object, target_context: Any) -> object:
        if not self._enabled:
            return None
        key = self._index_key(sig, target_context.codegen())
        try:
            stored = self._cache_file.load(key)
            # The index is written before the code: a process that was killed in between left the code of another key.
            if stored is None or stored[0] != key:
                return None
            return self._impl.rebuild(target_context, stored[1])
        except OSError:  # for numba to judge
            raise
        # Whatever unpickling raises: names of types that an earlier version had elsewhere, or a file that is cut off.
        except Exception:  # noqa: BLE001
            self.flush()
            return None

    def _save_overload(self, sig: object, data: Any) -> None:
        if self._enabled and self._impl.check_cachable(data):
            self._impl.locator.ensure_cache_path()
            key = self._index_key(sig, data.codegen)
            self._cache_file.save(key, (key, self._impl.reduce(data)))


def formula(function: FunctionT) -> FunctionT:
    """Compile a formula for use inside kernels; it is inlined there, and not cached on its own.

    It may be given arrays, but neither makes nor returns any: formulas are compiled without numba's reference counts,
    which take several times as long as the arithmetic. One that returns an array is refused as it is compiled; see
    `array_formula`.
    """
    dispatcher: Any = _njit(error_model="numpy", forceinline=True, _nrt=False)(function)
    if not _config.DISABLE_JIT:
        compile_uncounted = dispatcher.compile

        def compile_checked(signature: object) -> object:
            entry = compile_uncounted(signature)
            for overload in dispatcher.nopython_signatures:
                _refuse_arrays(function.__name__, overload.return_type)
            return entry

        dispatcher.compile = compile_checked
    return cast("FunctionT", dispatcher)


def array_formula(function: FunctionT) -> FunctionT:
    """Like `formula`, for functions that make or return arrays or records of them: references are counted.

    They are inlined too: only there is it seen which of the counts cancel.
    """
    return cast("FunctionT", _njit(error_model="numpy", forceinline=True)(function))


def kernel(function: FunctionT) -> FunctionT:
    """Compile an entry point, cache its machine code on disk, and let other threads run meanwhile.

    Where no folder can be written (a read-only installation without a home), each process compiles for itself.
    """
    dispatcher = _njit(error_model="numpy", nogil=True)(function)
    if not _config.DISABLE_JIT:
        # numba raises RuntimeError where it finds no folder to write to.
        with contextlib.suppress(RuntimeError):
            dispatcher._cache = _WholePackageCache(function)
    return cast("FunctionT", dispatcher)


def _refuse_arrays(name: str, return_type: Any) -> None:
    """Refuse a type that is an array or holds one: whoever is given it would free memory that others still use.

    Raises:
        TypeError: If it is.
    """
    if isinstance(return_type, numba.types.Array):
        raise TypeError(f"{name} returns an array: make it an array_formula")
    if isinstance(return_type, numba.types.BaseTuple):
        parts: Any = return_type
        for part in parts:
            _refuse_arrays(name, part)


def source_of(function: FunctionT) -> FunctionT:
    """Return the Python function behind a compiled one, to be called on other number types."""
    compiled: Any = function
    return cast("FunctionT", getattr(compiled, "py_func", function))

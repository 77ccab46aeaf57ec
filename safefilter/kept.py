"""Kept: a record of arrays that kernels are handed again and again, as one object.

Numba looks at every array that a kernel is handed, which takes 65 ns; at an object of its own that holds them all, half
a microsecond. That pays from ten arrays on, where they stay the same from call to call.
"""

from __future__ import annotations

from typing import Any, Generic, NamedTuple, TypeVar

import numba
from numba.experimental import structref

from safefilter.jit import kernel

# numba has no types for these.
_types: Any = numba.types
_define_proxy: Any = structref.define_proxy

RecordT = TypeVar("RecordT", bound=tuple[Any, ...])

if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]  # numba's stubs leave it out

    class KeptRecord(NamedTuple):
        """What kernels are given: `record` is the record."""

        record: Any

else:

    @structref.register
    class _KeptRecordType(_types.StructRef):  # type: ignore[misc]  # of any type, see above
        """Type of `KeptRecord` in kernels: one for each type of record."""

        def preprocess_fields(
            self, fields: list[tuple[str, object]]
        ) -> tuple[tuple[str, object], ...]:
            """Forget the values of literal types."""
            return tuple((name, _types.unliteral(kind)) for name, kind in fields)

    class KeptRecord(structref.StructRefProxy):  # type: ignore[no-redef]  # the other one is for plain Python
        """What kernels are given: `record` is the record."""

    _define_proxy(KeptRecord, _KeptRecordType, ["record"])


class Kept(Generic[RecordT]):
    """A record, and what kernels are handed for it.

    Attributes:
        record: Arrays and numbers by name; arrays are shared, not copied.
        handle: For kernels.
    """

    __slots__ = ("handle", "record")

    def __init__(self, record: RecordT) -> None:
        """Keep a record."""
        self.record = record
        self.handle: KeptRecord = _hand(record)

    def __reduce__(self) -> tuple[type[Kept[RecordT]], tuple[RecordT]]:
        """Copies and pickles are of the record: what is handed points to the arrays of this one."""
        return type(self), (self.record,)


@kernel
def _hand(record: tuple[Any, ...]) -> KeptRecord:
    return KeptRecord(record)

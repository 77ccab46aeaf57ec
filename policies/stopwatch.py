"""Stopwatch: where the time goes, part by part."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


class Stopwatch:
    """Adds up seconds by name.

    Attributes:
        seconds: So far, by name.
    """

    def __init__(self) -> None:
        """Nothing has been measured."""
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Add the time until the end of the block to ``name``, which may not hold another measurement."""
        start = perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - start

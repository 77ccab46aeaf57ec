"""Snapshots: everything that later steps of a simulator depend on, copied out and put back.

What holds state hands out its arrays by name, the ones it works with; a snapshot is a copy of them. Settings are no
part of it: it is put back into a simulator that was made alike.

Letters: W worlds, S walls of all worlds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from envs.walls import WallMap
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput

AnyArray = npt.NDArray[np.generic]
Snapshot = dict[str, Any]
"""Arrays, whole numbers, texts, lists and dictionaries, by name."""


class SnapshotError(InvalidInput):
    """A snapshot is of something else than what it is to be put back into."""


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What a simulator is made of, not copied.

    Attributes:
        arrays: Those that steps write to, by name.
        walls: Of all worlds.
        generators: One a world.
    """

    arrays: Mapping[str, AnyArray]
    walls: WallMap
    generators: list[np.random.Generator]

    def taken(self) -> Snapshot:
        """Copy everything."""
        walls = [self.walls.of(w) for w in range(len(self.generators))]
        return {
            "arrays": {name: array.copy() for name, array in self.arrays.items()},
            "walls": np.concatenate(walls),
            "num_walls": np.array([len(segments) for segments in walls]),
            "generators": [generator.bit_generator.state for generator in self.generators],
        }

    def put_back(self, snapshot: Snapshot) -> None:
        """Write everything back, or nothing.

        Args:
            snapshot: What `taken` returned once.

        Raises:
            SnapshotError: If it is of other worlds, robots or settings, or no snapshot.
        """
        arrays = snapshot.get("arrays")
        require_alike(self.arrays, arrays)
        walls = self._walls_of(snapshot)
        generators = self._generators_of(snapshot)
        for name, array in self.arrays.items():
            np.copyto(array, snapshot["arrays"][name])
        self.walls.replace(walls)
        self.generators[:] = generators

    def _walls_of(self, snapshot: Snapshot) -> dict[int, FloatArray]:
        kept = {name: snapshot.get(name) for name in ("num_walls", "walls")}
        require_alike(
            {"num_walls": np.zeros(len(self.generators), dtype=np.int64)},
            {"num_walls": kept["num_walls"]},
        )
        count = np.asarray(kept["num_walls"])
        require_alike({"walls": np.zeros((int(count.sum()), 2, 2))}, {"walls": kept["walls"]})
        return dict(enumerate(np.split(np.asarray(kept["walls"]), np.cumsum(count)[:-1])))

    def _generators_of(self, snapshot: Snapshot) -> list[np.random.Generator]:
        states = snapshot.get("generators")
        if not isinstance(states, list) or len(states) != len(self.generators):
            raise SnapshotError(
                f"snapshot: expected states of {len(self.generators)} generators, one a world"
            )
        generators = [np.random.default_rng(0) for _ in states]
        try:
            for generator, state in zip(generators, states, strict=True):
                generator.bit_generator.state = state
        except (TypeError, ValueError, KeyError) as error:
            raise SnapshotError(f"snapshot: no state of a generator: {error!r}") from error
        return generators


def require_alike(arrays: Mapping[str, AnyArray], kept: object) -> None:
    """Names, shapes and types are the same.

    Args:
        arrays: As they are.
        kept: As they were.

    Raises:
        SnapshotError: If not; the message names the first that differs.
    """
    if not isinstance(kept, Mapping) or set(kept) != set(arrays):
        given = sorted(map(str, kept)) if isinstance(kept, Mapping) else type(kept).__name__
        raise SnapshotError(f"snapshot: expected arrays {sorted(arrays)}, got {given}")
    for name, array in arrays.items():
        if _kind(kept[name]) != _kind(array):
            raise SnapshotError(
                f"snapshot, {name}: expected {_kind(array)}, got {_kind(kept[name])}; "
                "it was taken of other worlds, robots or settings"
            )


def _kind(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype} of shape {value.shape}"
    return type(value).__name__

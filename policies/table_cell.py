"""Cells of the table: one method in one scenario with the weights of one training, computed once and kept.

A cell is kept in a file whose name holds a digest of everything that decides what comes of it: method, filter,
scenario, weights, episodes, seeds, code and numerical packages. What is there is never computed again, and a file is
there as a whole or not at all.

Letters: W episodes, N robots. SI units.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
import zlib
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from envs.fleet import Fleet
from envs.robot_results import RobotResults
from envs.scenarios import recommended_rules
from policies.atomic_file import write_atomically
from policies.code_digest import code_digest
from policies.evaluation import run_episodes
from policies.kept_weights import WEIGHTS, find_weights
from policies.methods import Method, layout_of, policy_factory
from policies.policy_weights import Weights
from policies.table_scenarios import find_scenario, scenario_text
from safefilter.bounded_file import read_bounded
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

DIGITS = 16
"""Of a digest, in names of files."""
MAX_BYTES = 2**28
"""Largest cell, packed and unpacked: ten thousand episodes of 8 robots take 8 MB."""
# What reading an archive that is none of ours ends in.
CELL_ERRORS = (
    OSError, EOFError, ValueError, KeyError, TypeError, OverflowError, NotImplementedError, RuntimeError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip
KINDS = {"IntArray": "i", "FloatArray": "f"}
"""Of numbers, as numpy calls them."""
NUMERICAL_PACKAGES = ("numba", "numpy")


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell.

    Attributes:
        method: Who drives behind which filter; none of a file of elsewhere.
        scenario: Where, see `policies.table_scenarios`.
        episodes: How many.
        seed: Of the episodes.
        training_seed: Of the weights; None where nothing is learnt.
        priority: Of the robots, where the scenario does not say; None: 1.
        weights: Folder of the weights.
    """

    method: Method
    scenario: str
    episodes: int
    seed: int
    training_seed: int | None = None
    priority: tuple[float, ...] | None = None
    weights: Path = WEIGHTS

    def read_weights(self) -> Weights | None:
        """The weights that drive; None where nothing is learnt.

        Raises:
            CheckpointMissing: If there are none; says which command trains them.
            CheckpointError: If they cannot be used.
        """
        if self.method.training is None or self.training_seed is None:
            return None
        return find_weights(self.method.training, self.training_seed, self.weights)

    @property
    def title(self) -> str:
        """For people."""
        seed = "" if self.training_seed is None else f", seed {self.training_seed}"
        return f"{self.method.label}{seed}, {self.scenario}"

    @property
    def work(self) -> float:
        """Rough amount of work, in seconds of robots that know the map: longer cells are begun first."""
        scenario = find_scenario(self.scenario)
        time = recommended_rules(scenario).time_limit
        return (
            self.episodes
            * scenario.num_robots
            * time
            * (2.0 if self.method.filtering.is_scanned else 1.0)
        )

    def digest(self) -> str:
        """Digest of everything that decides what comes of it, in hexadecimal.

        Raises:
            CheckpointError: If its weights cannot be read.
        """
        decides = {
            "method": asdict(self.method),
            "scenario": scenario_text(find_scenario(self.scenario)),
            "episodes": self.episodes,
            "seed": self.seed,
            "priority": self.priority,
            "weights": _weights_digest(self.read_weights()),
            "code": code_digest(__name__),
            "packages": {name: version(name) for name in NUMERICAL_PACKAGES},
        }
        return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()

    def compute(self) -> RobotResults:
        """Drive its episodes."""
        weights = self.read_weights()
        scenario = find_scenario(self.scenario)
        priority = 1.0 if self.priority is None else self.priority
        return run_episodes(
            policy_factory(self.method, weights),
            scenario,
            self.method.filtering,
            episodes=self.episodes,
            seed=self.seed,
            layout=layout_of(weights),
            lateness=self.method.lateness,
            fleet=Fleet.of(scenario.num_robots, priority=priority, kinematics="differential"),
        )


@dataclass(frozen=True, slots=True)
class CellFolder:
    """Where cells are kept.

    Attributes:
        path: The folder; made as the first cell is kept.
    """

    path: Path

    def file_of(self, cell: Cell) -> Path:
        """Where a cell is kept."""
        seed = "" if cell.training_seed is None else f"-{cell.training_seed}"
        scenario = Path(cell.scenario).stem
        return self.path / f"{cell.method.name}{seed}-{scenario}-{cell.digest()[:DIGITS]}.npz"

    def read(self, cell: Cell) -> RobotResults | None:
        """What came of a cell, or None if it has not been computed.

        Raises:
            InvalidInput: If its file cannot be used.
        """
        path = self.file_of(cell)
        if not path.is_file():
            return None
        try:
            return _unpacked(read_bounded(path, MAX_BYTES))
        except CELL_ERRORS as error:
            raise InvalidInput(f"{path}: cannot be read, delete it: {error}") from error

    def write(self, cell: Cell, results: RobotResults) -> None:
        """Keep what came of a cell."""
        content = io.BytesIO()
        np.savez_compressed(
            content,
            allow_pickle=False,
            **{field.name: getattr(results, field.name) for field in fields(results)},
        )
        self.path.mkdir(parents=True, exist_ok=True)
        write_atomically(self.file_of(cell), content.getvalue())


def _unpacked(content: bytes) -> RobotResults:
    """Results from a file; `CELL_ERRORS` say that it is none.

    Raises:
        OutOfRange: If it unpacks to more than a cell has: a few bytes can stand for any number.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(part.file_size for part in archive.infolist())
        if size > MAX_BYTES:
            raise OutOfRange(f"expected at most {MAX_BYTES} bytes unpacked, got {size}")
        return RobotResults(**{
            field.name: _array_of(archive.read(f"{field.name}.npy"), field.name, str(field.type))
            for field in fields(RobotResults)
        })


def _array_of(content: bytes, name: str, kind: str) -> npt.NDArray[Any]:
    """An array as numpy writes it, once it is known that all of it is there.

    Raises:
        ShapeError: If its header announces other numbers, or more or fewer of them.
    """
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ShapeError(f"{name}: expected an array of version 1.0, got {version}")
    shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(file)
    left = content[file.tell() :]
    if dtype.kind != KINDS[kind] or len(left) != math.prod(shape) * dtype.itemsize:
        raise ShapeError(
            f"{name}: expected {kind}, got {dtype} of shape {shape} in {len(left)} bytes"
        )
    return np.frombuffer(left, dtype).reshape(shape, order="F" if is_fortran else "C")


def _weights_digest(weights: Weights | None) -> str:
    """Of what drives: tensors and what they observe. Where they come from decides nothing."""
    digest = hashlib.sha256()
    if weights is not None:
        digest.update(repr(weights.layout).encode())
        for name, array in sorted(weights.arrays.items()):
            digest.update(f"{name} {array.shape}".encode())
            digest.update(array.tobytes())
    return digest.hexdigest()

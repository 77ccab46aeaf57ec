"""The log of a campaign: one line of JSON a case, each with a digest of itself, appended and flushed to disk whole.

One process writes it, under a lock. Whoever is killed loses at most the last line, which is dropped when the log is
opened again, and its case repeated; every other line that is not as it was written is an error.

The lock is `fcntl.flock`: on systems without it, see to it that one process writes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

from assurance.stress.cases import Result
from safefilter.errors import InvalidInput

if os.name == "posix":
    import fcntl

DIGITS = 16
"""Of SHA-256, in hexadecimal: a line that was altered by accident or hand passes once in 10^19."""


class LogError(InvalidInput):
    """A log is not as it was written, or not of this campaign."""


@dataclass(frozen=True, slots=True)
class Run:
    """One start of the command; a campaign that was stopped has several.

    Attributes:
        seed: Of the campaign.
        scale: Of the campaign.
        steps: Robot-steps wanted.
        processes: Number of processes.
        code: Digest of all code that cases run.
        commit: Of git, with a + where files were changed; empty where there is none.
        started: Time, ISO 8601, UTC.
        machine: Processor, Python and packages.
    """

    seed: int
    scale: float
    steps: int
    processes: int
    code: str
    commit: str
    started: str
    machine: str


@dataclass(frozen=True, slots=True)
class Entries:
    """What a log holds.

    Attributes:
        runs: In the order of time.
        results: By the number of the case.
    """

    runs: tuple[Run, ...]
    results: dict[int, Result]


class CaseLog:
    """A log that is open for writing."""

    def __init__(self, file: BinaryIO, entries: Entries) -> None:
        self._file, self.entries = file, entries

    @classmethod
    def open(cls, path: Path, run: Run) -> Self:
        """Lock a log, drop a last line that was cut, and note a new run.

        Args:
            path: The log; it is made if it is not there.
            run: Noted in it.

        Raises:
            LogError: If another process writes it, it was altered, or it is of another campaign: of another seed or
                scale, or of other code.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+b", buffering=0)
        try:
            _lock(file, path)
            entries = read_log(path)
            for before in entries.runs[-1:]:
                for what in ("seed", "scale", "code"):
                    there, now = getattr(before, what), getattr(run, what)
                    if there != now:
                        raise LogError(
                            f"{path}: holds cases of {what} {there}, not of {what} {now}; "
                            "move it away, or choose another --out"
                        )
            file.truncate(_whole(path.read_bytes()))
            log = cls(file, Entries((*entries.runs, run), entries.results))
            log._append({"run": asdict(run)})
        except BaseException:
            file.close()
            raise
        return log

    def note(self, result: Result) -> None:
        """Append a case, and see that it is on disk."""
        self._append({"case": result.as_json()})
        self.entries.results[result.number] = result

    def close(self) -> None:
        """Let go of the lock."""
        self._file.close()

    def _append(self, record: dict[str, Any]) -> None:
        self._file.write(line_of(record))
        os.fsync(self._file.fileno())


def line_of(record: dict[str, Any]) -> bytes:
    """A record as a line with its digest."""
    text = json.dumps(record, separators=(",", ":"), allow_nan=False)
    return f"{_digest(text)} {text}\n".encode()


def read_log(path: Path) -> Entries:
    """Read a log; a last line without its end, of a process that was killed, is left out.

    Args:
        path: The log; a file that is not there holds nothing.

    Raises:
        LogError: If a line was altered, or a case is there twice.
    """
    content = path.read_bytes() if path.exists() else b""
    runs, results = list[Run](), dict[int, Result]()
    for number, record in _records(content[: _whole(content)], path):
        if "run" in record:
            runs.append(Run(**record["run"]))
            continue
        result = Result.from_json(record["case"])
        if result.number in results:
            raise LogError(f"{path}, line {number}: case {result.number} is there a second time")
        results[result.number] = result
    if results and not runs:
        raise LogError(f"{path}: the line of the run that made these cases is missing")
    return Entries(tuple(runs), results)


def _records(content: bytes, path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    # Not splitlines(): that would take other characters than the one written for ends of lines.
    for number, line in enumerate(content.decode(errors="replace").split("\n")[:-1], start=1):
        digest, _, text = line.partition(" ")
        if digest != _digest(text):
            raise LogError(
                f"{path}, line {number}: was altered, or cut in the middle of the log; "
                "take the log from a copy, or begin anew with another --out"
            )
        yield number, json.loads(text)


def _whole(content: bytes) -> int:
    """Number of bytes of whole lines."""
    return content.rfind(b"\n") + 1


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def _lock(file: BinaryIO, path: Path) -> None:
    if os.name != "posix":
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise LogError(
            f"{path}: another campaign is writing it; wait for it, or stop it"
        ) from error

"""Recordings as files: JSON Lines, written while the episode goes on.

The first line says what stays the same, each further one is a moment, and the last one says that the episode was
written to its end. All numbers are written so that they come back bit for bit. Every line ends with a CRC-32 of itself
and of all lines before it, so that a line that was changed, lost or moved is noticed; that is no protection from
those who mean to deceive. ``docs/envs.md`` lists the fields.

SI units.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from envs.recording import Moment, Recording, Setting
from safefilter.arrays import finite_array, frozen, positive_number
from safefilter.bounded_file import require_bounded
from safefilter.errors import InvalidInput

FORMAT = "safefilter recording"
VERSION = 1
SUFFIX = ".jsonl"
_CHECKSUM = ',"crc32":"'
_FIRST = f'{{"format":"{FORMAT}"'
_TAIL = len(_CHECKSUM) + len('00000000"}')

# A thousand robots for an hour; in memory it takes several times as much.
MAX_BYTES = 2**30


class RecordingFileError(InvalidInput):
    """A file is no recording, or not as it was written; the message names file, line and reason."""


class RecordingCut(RecordingFileError):
    """A recording ends before its episode did; what is there can be read."""


class RecordingWriter:
    """Writes an episode, moment by moment; what was written is readable even if the program ends here."""

    def __init__(self, path: Path, setting: Setting) -> None:
        """Begin a file; one that is there is replaced.

        Args:
            path: File to write.
            setting: What stays the same.
        """
        # One line at a time goes to disk.
        self._file = path.open("w", encoding="utf-8", buffering=1, newline="\n")
        self._checksum = 0
        self._num_moments = 0
        self._write({"format": FORMAT, "version": VERSION, **_plain(setting)})

    def write(self, moment: Moment) -> None:
        """Add a moment."""
        self._write(_plain(moment))
        self._num_moments += 1

    def close(self, *, is_whole: bool = True) -> None:
        """End the file.

        Args:
            is_whole: Is this the end of the episode, and not of the program?
        """
        if self._file.closed:
            return
        if is_whole:
            self._write({"end": True, "num_moments": self._num_moments})
        self._file.close()

    def __enter__(self) -> Self:
        """Nothing to do."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file; after an error as one that was cut."""
        self.close(is_whole=kind is None)

    def _write(self, record: dict[str, Any]) -> None:
        body = json.dumps(record, separators=(",", ":"), allow_nan=False)
        self._checksum = zlib.crc32(body.encode(), self._checksum)
        self._file.write(f'{body[:-1]}{_CHECKSUM}{self._checksum:08x}"}}\n')


def read_recording(path: str | Path, *, may_be_cut: bool = False) -> Recording:
    """Read an episode.

    Args:
        path: File that a `RecordingWriter` wrote.
        may_be_cut: Take one that ends before its episode did, up to its last whole moment.

    Raises:
        RecordingFileError: If the file cannot be read, is something else or of another version, or was changed.
        RecordingCut: If it was cut, and may not be; or is cut before the first moment.
    """
    path = Path(path)
    lines = _checked_lines(path)
    setting = _setting_of(path, lines)
    moments: list[Moment] = []
    is_whole = False
    for number, record in lines:
        if is_whole:
            raise RecordingFileError(f"{path}:{number}: there is more after the end")
        if "end" in record:
            is_whole = record.get("num_moments") == len(moments)
        else:
            moments.append(_moment_of(path, number, record, setting))
            _require_next(path, number, moments)
    if not moments or not (is_whole or may_be_cut):
        raise RecordingCut(
            f"{path}: cut after {len(moments)} moments, before the end of the episode"
            + ("; pass may_be_cut=True to read those" if moments else "")
        )
    return Recording.of(setting, moments)


def _checked_lines(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    """Number and content of each whole line.

    Raises:
        RecordingFileError: If the file cannot be read, or a line is not as it was written.
    """
    checksum = 0
    try:
        require_bounded(path, MAX_BYTES)
        with path.open(encoding="utf-8", newline="\n") as file:
            for number, line in enumerate(file, 1):
                if number == 1 and line and not _begins_alike(line, _FIRST):
                    raise RecordingFileError(f"{path}:1: no recording of this package")
                if not line.endswith("\n"):
                    return  # cut within this line
                body = line[: -_TAIL - 1] + "}"
                checksum = zlib.crc32(body.encode(), checksum)
                if line[-_TAIL - 1 :] != f'{_CHECKSUM}{checksum:08x}"}}\n':
                    raise RecordingFileError(
                        f"{path}:{number}: changed, or moved: the checksum differs"
                    )
                record = json.loads(body)
                if not isinstance(record, dict):
                    raise RecordingFileError(f"{path}:{number}: expected an object")
                yield number, record
    except RecordingFileError:
        raise
    except InvalidInput as error:  # too large, or no file
        raise RecordingFileError(str(error)) from None
    except (OSError, ValueError, RecursionError) as error:
        raise RecordingFileError(f"{path}: cannot be read: {error}") from error


def _begins_alike(one: str, other: str) -> bool:
    length = min(len(one), len(other))
    return one[:length] == other[:length]


def _setting_of(path: Path, lines: Iterator[tuple[int, dict[str, Any]]]) -> Setting:
    number, record = next(lines, (1, None))
    if record is None:
        raise RecordingCut(f"{path}: cut within its first line")
    if record.get("version") != VERSION:
        raise RecordingFileError(
            f"{path}:{number}: expected version {VERSION}, got {record.get('version')!r}; "
            "read it with the release that wrote it"
        )
    with _naming(path, number):
        return _read_setting(record)


def _moment_of(path: Path, number: int, record: dict[str, Any], setting: Setting) -> Moment:
    with _naming(path, number):
        return _read_moment(record, setting.num_robots)


@contextmanager
def _naming(path: Path, number: int) -> Iterator[None]:
    """Name file and line where fields are missing or of another shape.

    Raises:
        RecordingFileError: If they are.
    """
    try:
        yield
    except KeyError as error:
        raise RecordingFileError(f"{path}:{number}: {error} is missing") from error
    except (ValueError, TypeError, OverflowError) as error:
        raise RecordingFileError(f"{path}:{number}: {error}") from error


def _read_setting(record: dict[str, Any]) -> Setting:
    num_robots = len(record["radius"])
    per_robot = {
        name: frozen(finite_array(record[name], name, (num_robots,)))
        for name in ("radius", "v_max", "priority")
    }
    walls = np.array(record["walls"], dtype=np.float64).reshape(-1, 2, 2)
    return Setting(
        scenario=str(record["scenario"]),
        seed=None if record["seed"] is None else int(record["seed"]),
        dt=positive_number(record["dt"], "dt"),
        has_heading=bool(record["has_heading"]),
        goal=frozen(finite_array(record["goal"], "goal", (num_robots, 2))),
        person=frozen(_whole(record, "person", num_robots).astype(np.bool_)),
        walls=frozen(finite_array(walls, "walls", walls.shape)),
        **per_robot,
    )


def _read_moment(record: dict[str, Any], num_robots: int) -> Moment:
    return Moment(
        step=int(record["step"]),
        position=finite_array(record["position"], "position", (num_robots, 2)),
        heading=finite_array(record["heading"], "heading", (num_robots,)),
        action=finite_array(record["action"], "action", (num_robots, 2)),
        case=_whole(record, "case", num_robots),
        **{
            name: _whole(record, name, num_robots).astype(np.bool_)
            for name in ("arrived", "collided", "present")
        },
    )


def _whole(record: dict[str, Any], field: str, num_robots: int) -> npt.NDArray[np.int64]:
    return finite_array(record[field], field, (num_robots,)).astype(np.int64)


def _require_next(path: Path, number: int, moments: list[Moment]) -> None:
    if moments[-1].step != len(moments) - 1:
        raise RecordingFileError(
            f"{path}:{number}: expected step {len(moments) - 1}, got {moments[-1].step}"
        )


def _plain(record: Setting | Moment) -> dict[str, Any]:
    """Fields as numbers, texts and lists; flags as 0 and 1, which are shorter."""
    plain: dict[str, Any] = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            value = (value.astype(np.int64) if value.dtype == np.bool_ else value).tolist()
        plain[field.name] = value
    return plain

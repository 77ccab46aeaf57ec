"""What a measurement ran on, and when."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

CPU_INFO = Path("/proc/cpuinfo")
# Load of a machine, processes that want to run, from which on somebody else's work is in the figures.
QUIET = 0.5


def describe_machine(packages: Sequence[str]) -> dict[str, str]:
    """Processor, cores, system, versions and date, to print and to keep with results; packages missing are left out."""
    return {
        "date": datetime.now(tz=UTC).strftime("%Y-%m-%d"),
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "load at start": f"{load():.1f}",
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
    } | {package: found for package in packages if (found := _version(package))}


def load() -> float:
    """Processes that wanted to run in the last minute, on average; 0 where nobody counts them."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def is_quiet(load_at_start: float) -> bool:
    """Did nobody else want to run?"""
    return load_at_start < QUIET


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    if CPU_INFO.exists():
        for line in CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()

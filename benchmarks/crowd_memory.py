"""Memory that a step of a crowd takes, ours and RVO2's, each in a process of its own.

Linux only: the kernel tells how much of a process is in memory, and how much was at most.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np

from benchmarks.crowd_states import Crowd, crowd_filter, make_crowd
from benchmarks.results import Row
from safefilter import Decision, Scene

ROOT = Path(__file__).parents[1]
STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")
# Large arrays go back to the system when they are freed: what was freed before must not serve what is measured.
GIVE_BACK = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536"}
OURS, THEIRS = "filter", "RVO2"
# Machine code and thread pools are loaded by a crowd of this size before anything is measured.
SMALL = 500


def memory_rows(num_robots: int) -> Iterator[Row]:
    """Measure both, in bytes a robot; nothing where the kernel does not tell."""
    if not RESET.exists():
        return
    group = f"memory in bytes a robot, {num_robots} robots"
    theirs = _in_process(THEIRS, num_robots)
    yield Row(THEIRS, group, theirs, 1.0)
    ours = _in_process(OURS, num_robots)
    yield Row(OURS, group, ours, ours["at most"] / theirs["at most"])


def _in_process(which: str, num_robots: int) -> dict[str, float]:
    command = [sys.executable, "-m", "benchmarks.crowd_memory", which, str(num_robots)]
    environment = dict(os.environ, **GIVE_BACK)
    done = subprocess.run(
        command, check=True, capture_output=True, text=True, cwd=ROOT, env=environment
    )
    found: dict[str, float] = json.loads(done.stdout)
    return found


def measure_memory(which: str, num_robots: int) -> dict[str, float]:
    """Take one step; returns bytes a robot: kept afterwards, at most meanwhile, and in the arrays of the results."""
    crowd_filter().decide(make_crowd(SMALL).scene(), make_crowd(SMALL).wanted)
    crowd = make_crowd(num_robots, steps=1)
    # The peak starts again from what is there now.
    RESET.write_text("5", encoding="ascii")
    before = _resident("VmRSS")
    made = _simulated(crowd) if which == THEIRS else _decided(crowd)
    kept, at_most = _resident("VmRSS") - before, _resident("VmHWM") - before
    arrays = {
        name: _size(record) for name, record in made.items() if isinstance(record, Scene | Decision)
    }
    found = {"kept": kept, "at most": at_most, **arrays}
    return {name: size / num_robots for name, size in found.items()}


def _simulated(crowd: Crowd) -> dict[str, object]:
    sim = crowd.simulator()
    sim.do_step()
    return {"simulator": sim}


def _decided(crowd: Crowd) -> dict[str, object]:
    scene = crowd.scene()
    return {"scene": scene, "decision": crowd_filter().decide(scene, crowd.wanted)}


def _size(record: Scene | Decision) -> float:
    """Bytes of the arrays of a record; of columns of one block their own part."""
    values = (getattr(record, field.name) for field in fields(record))
    return float(sum(value.nbytes for value in values if isinstance(value, np.ndarray)))


def _resident(field: str) -> float:
    line = next(
        line for line in STATUS.read_text(encoding="ascii").splitlines() if line.startswith(field)
    )
    return 1024.0 * float(line.split()[1])


if __name__ == "__main__":
    print(json.dumps(measure_memory(sys.argv[1], int(sys.argv[2]))))

"""Import and first decision, right after installation and in a later process.

numba compiles the kernels once and keeps the machine code on disk. Each process here has the folder for that to itself.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.results import Result, Row

ROOT = Path(__file__).parents[1]
LATER_PROCESSES = 5
SCRIPT = """
import json, time
start = time.perf_counter()
import numpy, numba
without = time.perf_counter()
import safefilter
imported = time.perf_counter()
scene = safefilter.Scene.from_world([[0, 0], [1, 0]], [[0.2, 0], [-0.2, 0]], 0.1)
constraints = [safefilter.PriorityORCA(2.0), safefilter.Separation(0.2)]
safety = safefilter.SafetyFilter(constraints, safefilter.Holonomic(0.2))
safety.decide(scene, [[0.2, 0.0], [-0.2, 0.0]])
first = time.perf_counter()
safety.decide(scene, [[0.2, 0.0], [-0.2, 0.0]])
second = time.perf_counter()
print(json.dumps({
    "import numpy, numba": without - start,
    "import safefilter": imported - without,
    "first decision": first - imported,
    "second decision": second - first,
}))
"""
GROUPS = ("after installation: nothing compiled yet", "in a later process: machine code on disk")


def measure(*, quick: bool = False) -> Result:
    """Start processes and let them tell.

    Args:
        quick: One later process instead of several.
    """
    with tempfile.TemporaryDirectory() as cache:
        cold = _start(Path(cache))
        warm = [_start(Path(cache)) for _ in range(1 if quick else LATER_PROCESSES)]
    rows = []
    for group, runs in zip(GROUPS, ([cold], warm), strict=True):
        reference = float(np.median([run["import numpy, numba"] for run in runs]))
        for name in cold:
            taken = float(np.median([run[name] for run in runs]))
            rows.append(Row(name, group, {"seconds": taken}, taken / reference))
    return Result(
        name="start_up",
        title="Import and first decisions of a process, in s",
        ratio_of="import numpy, numba",
        rows=tuple(rows),
        notes=(
            "'import safefilter' is what it takes on top of numpy and numba.",
            "The first decision makes its scene and filter, and compiles or loads the kernels.",
        ),
    )


def _start(cache: Path) -> dict[str, float]:
    environment = dict(os.environ, NUMBA_CACHE_DIR=str(cache), PYTHONPATH=str(ROOT))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True, env=environment
    )
    seconds: dict[str, float] = json.loads(done.stdout)
    return seconds

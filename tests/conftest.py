"""Settings of every test run: Hypothesis profiles, and one numba cache a worker.

Profiles, chosen by the environment variable ``HYPOTHESIS_PROFILE``: ``dev`` (default; new examples at every run),
``ci`` (the same examples at every run), ``coverage`` (few, because kernels are interpreted there), ``mutants`` (the
same few, and a failure is not shrunk), ``fuzz`` (very many, new ones at every run).
"""

import os
from pathlib import Path

from hypothesis import HealthCheck, Phase, settings

# Workers that compile one kernel for different argument types at the same time can swap each other's files in
# numba's cache, so each has its own. Must be set before numba is imported.
if worker := os.environ.get("PYTEST_XDIST_WORKER"):
    cache = Path(__file__).parents[1] / ".pytest_cache" / "numba" / worker
    os.environ.setdefault("NUMBA_CACHE_DIR", str(cache))

# Windows open nowhere. Must be set before pygame is imported.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# The first example pays for numba's compiler, seconds long: neither deadlines nor slow drawing say anything here.
settings.register_profile("dev", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("dev"), derandomize=True, print_blob=True)
settings.register_profile(
    "coverage", settings.get_profile("dev"), max_examples=10, derandomize=True
)
settings.register_profile("fuzz", settings.get_profile("dev"), max_examples=2000)
settings.register_profile(
    "mutants",
    settings.get_profile("coverage"),
    database=None,
    phases=[Phase.explicit, Phase.generate],
    report_multiple_bugs=False,
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "dev"))

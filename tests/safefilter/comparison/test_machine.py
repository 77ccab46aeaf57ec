"""What a measurement ran on."""

from __future__ import annotations

import numpy as np

from safefilter.comparison.machine import QUIET, describe_machine, is_quiet, load


def test_versions_are_those_of_what_is_installed() -> None:
    machine = describe_machine(["numpy", "no-such-package"])
    assert machine["numpy"] == np.__version__
    assert "no-such-package" not in machine
    assert all(machine.values())
    assert {"date", "processor", "cores", "load at start", "system", "python"} <= set(machine)


def test_a_load_says_whether_figures_can_be_trusted() -> None:
    assert load() >= 0.0
    assert is_quiet(0.0)
    assert not is_quiet(QUIET)

import runpy
from pathlib import Path

import pytest
from hypothesis import Phase, settings
from hypothesis.stateful import run_state_machine_as_test

import safefilter as sf
from safefilter.testing import Collision, closed_loop
from safefilter.wrappers import SafeParallelEnv

EXAMPLE = Path(__file__).parents[2] / "examples" / "check_mpe.py"
FEW = settings(max_examples=3, stateful_step_count=10, deadline=None)
# The first failure will do, however long.
MANY = settings(max_examples=100, stateful_step_count=20, deadline=None, phases=[Phase.generate])


def test_particles_with_the_filter_pass_and_hasty_ones_do_not() -> None:
    example = runpy.run_path(str(EXAMPLE))
    run_state_machine_as_test(example["loop"], settings=FEW)
    hasty = sf.SafetyFilter([sf.Separation(example["DT"] / 10)], sf.Holonomic(example["V_MAX"]))
    loop = closed_loop(example["Velocities"], lambda env: SafeParallelEnv(env, hasty))
    with pytest.raises(Collision, match=r"robots . and . collide"):
        run_state_machine_as_test(loop, settings=MANY)

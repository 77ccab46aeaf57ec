import runpy
from pathlib import Path

import pytest
from hypothesis import Phase, settings
from hypothesis.stateful import run_state_machine_as_test

from safefilter.testing import Collision

EXAMPLE = Path(__file__).parents[2] / "examples" / "check_pendulum.py"
FEW = settings(max_examples=3, stateful_step_count=10, deadline=None)
# The first failure will do, however long.
MANY = settings(max_examples=100, stateful_step_count=20, deadline=None, phases=[Phase.generate])


def test_the_pendulum_with_both_barriers_passes_and_with_one_it_does_not() -> None:
    example = runpy.run_path(str(EXAMPLE))
    run_state_machine_as_test(example["loop"], settings=FEW)
    example["BARRIERS"].pop()
    with pytest.raises(Collision, match="the clearance falls"):
        run_state_machine_as_test(example["loop"], settings=MANY)

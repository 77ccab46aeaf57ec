import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "wrap_any_policy.py"


@pytest.mark.stress
def test_filter_brings_every_robot_to_its_goal(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    off, on = capsys.readouterr().out.splitlines()
    assert off.startswith("filter off: ")
    assert not off.startswith("filter off: 0 of 20")
    assert on == "filter on: 0 of 20 collided, 20 arrived"

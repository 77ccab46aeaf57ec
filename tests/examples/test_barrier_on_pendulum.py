import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "barrier_on_pendulum.py"


@pytest.mark.stress
def test_the_pendulum_stays_within_the_limit_with_the_filter_only(
    capsys: pytest.CaptureFixture[str],
) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    rows = [line[10:].split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[0] for row in rows] == ["off", "on"] * 3
    for word, angle, _, correction, *_ in rows:
        if word == "off":
            assert float(angle) > 3.0
            assert float(correction) == 0.0
        else:
            assert float(angle) <= 0.3
            assert float(correction) > 0.0

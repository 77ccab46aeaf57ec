import pytest

from policies.drive_campaign import WAYS
from policies.stress import main


@pytest.mark.stress
def test_the_command_prints_what_happened_in_every_way(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--steps", "2e3", "--seed", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["robot-steps", "with", "robots"]
    rows = {way: line[16:].split() for line in lines[1:] for way in WAYS if line.startswith(way)}
    assert set(rows) == set(WAYS)
    assert int(rows["filter on"][0]) >= 2000
    assert rows["filter on"][1:4] == ["0", "0", "0"]
    assert int(rows["filter on"][9]) == 0
    for way in ("cap off", "separation off", "filter off"):
        assert int(rows[way][1]) + int(rows[way][2]) > 0


def test_one_way_may_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    # Without the filter there is nothing to fail.
    assert main(["--steps", "300", "--ways", "filter off"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_options_are_explained(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert "robot-steps (default: 1e6)" in capsys.readouterr().out

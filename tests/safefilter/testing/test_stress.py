import pytest

from safefilter.testing.stress import main


def test_the_command_prints_what_happened_with_and_without_the_filter(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--steps", "1e3", "--seed", "3"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:4] == ["robot-steps", "collisions", "per", "1e6"]
    rows = {name: line[32:].split() for line in lines[1:] for name in ROWS if line.startswith(name)}
    assert set(rows) == set(ROWS)
    assert int(rows["filter on, planar"][0]) >= 1000
    assert int(rows["filter on, planar"][1]) == 0
    assert int(rows["filter on, planar"][7]) == 0
    assert int(rows["separation off, ORCA on, planar"][1]) > 0
    assert int(rows["filter off"][1]) > int(rows["separation off, ORCA on, planar"][1])


ROWS = ("filter on, planar", "separation off, ORCA on, planar", "filter off")


def test_another_backend_may_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--steps", "100", "--backend", "clarabel"]) == 0
    assert "filter on, clarabel" in capsys.readouterr().out


def test_options_are_explained(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert "robot-steps (default: 1e6)" in capsys.readouterr().out

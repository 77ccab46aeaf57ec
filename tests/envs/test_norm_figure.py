from pathlib import Path

import pytest
from matplotlib.image import imread

from envs.norm_area import NormArea
from envs.norm_figure import distance_lines, main


def test_command_draws_the_picture_and_prints_both_readings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "new" / "area.png"
    main(target)
    picture = imread(target)
    assert picture.shape[0] > 500
    assert picture.std() > 0.05
    printed = capsys.readouterr().out
    assert "shipped" in printed
    assert "other reading" in printed
    assert str(target) in printed


def test_lines_hold_the_figures_that_the_docs_quote() -> None:
    text = "\n".join(distance_lines(NormArea.of_paper()))
    documented = (Path(__file__).parents[2] / "docs" / "paper.md").read_text(encoding="utf-8")
    for line in text.splitlines():
        assert line.rstrip() in documented

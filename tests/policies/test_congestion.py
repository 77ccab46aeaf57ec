import pytest
from rich.console import Console

from policies.congestion import Settings, drive, main


def test_the_narrower_the_road_the_longer_it_takes() -> None:
    settings = Settings(worlds=8)
    narrow, wide = (drive(width, settings).summary for width in (0.95, 1.6))
    assert narrow.mean_time > wide.mean_time + 2.0
    assert narrow.num_collided == wide.num_collided == 0


def test_each_width_has_its_row(capsys: pytest.CaptureFixture[str]) -> None:
    main(Settings(widths=(1.25, 1.6), worlds=1), Console(width=80))
    printed = capsys.readouterr().out
    assert "1.25" in printed
    assert "1.6" in printed

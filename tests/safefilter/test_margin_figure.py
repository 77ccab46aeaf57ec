from pathlib import Path

import matplotlib.image
import pytest

from safefilter.testing.margin_figure import STYLES, CellFigures, save_figure


@pytest.mark.parametrize("num_errors", [1, len(STYLES)])
def test_every_error_is_drawn(num_errors: int, tmp_path: Path) -> None:
    cells: list[CellFigures] = [
        {
            "error": f"error_{k}",
            "real": 0.1,
            "ratio": ratio,
            "encounters": 10,
            "collisions": k,
            "clearance": ratio - 0.5,
            "crossing_clearance": 1.0,
            "time_to_goal": 10.0 + k,
        }
        for k in range(num_errors)
        for ratio in (0.0, 1.0)
    ]
    path = tmp_path / "margins.png"
    save_figure(cells, path)
    picture = matplotlib.image.imread(path)
    assert picture.shape[0] > 200
    # The first error's colour, and that of the last.
    for colour, _ in (STYLES[0], STYLES[num_errors - 1]):
        parts = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
        assert (abs(picture[..., :3] - parts) < 0.02).all(axis=-1).any()

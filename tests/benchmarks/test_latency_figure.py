import json
from pathlib import Path

from benchmarks.latency_figure import draw_latency


def test_a_figure_is_drawn_of_what_was_saved(tmp_path: Path) -> None:
    source = tmp_path / "latency.json"
    numbers = {"p50": 2.0, "p99": 3.0, "p99.9": 5.0, "max": 7.0}
    series = {
        "us": [1.0, 2.0, 4.0, 8.0, 16.0],
        "Case-1": [5, 1, 0, 0],
        "Case-2": [0, 9, 1, 0],
        "Case-3": [0, 0, 2, 0],
    }
    found = {"rows": [{"name": "all", "group": "18", "numbers": numbers}], "series": series}
    source.write_text(json.dumps(found), encoding="utf-8")
    target = draw_latency(source, tmp_path / "latency.png")
    assert target.read_bytes().startswith(b"\x89PNG")

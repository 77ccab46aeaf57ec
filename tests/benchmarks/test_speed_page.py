from dataclasses import replace
from pathlib import Path

from benchmarks.results import Result, Row, save
from benchmarks.speed_page import PAGE, with_tables, write_page

RESULT = Result("example", "Something, in us", "this", (Row("this", "a", {"p50": 2.0}, 1.0),), ())


def test_the_page_shows_what_is_committed() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert with_tables(page) == page
    for name in ("crowd_step", "latency", "floor"):
        assert f"<!-- {name} -->" in page
        assert "* Measured on: date" in page.split(f"<!-- end of {name} -->")[0]


def test_a_table_stands_between_its_markers_and_is_replaced_by_the_next(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- example -->\n<!-- end of example -->\nafter\n", encoding="utf-8")
    for title in ("Something, in us", "Something else"):
        save(replace(RESULT, title=title), {"processor": "abacus"}, tmp_path)
        write_page(page, tmp_path)
        text = page.read_text(encoding="utf-8")
        assert text.startswith("before\n<!-- example -->\n")
        assert text.endswith("<!-- end of example -->\nafter\n")
        assert text.count("## ") == 1
        assert f"## {title}\n" in text

"""Put the tables of saved results into docs/speed.md, each between its two markers, so that no figure is typed."""

from __future__ import annotations

from pathlib import Path

from benchmarks.results import FOLDER, as_markdown, read_result

PAGE = Path(__file__).parents[1] / "docs" / "speed.md"


def with_tables(page: str, folder: Path = FOLDER) -> str:
    """Replace what stands between ``<!-- NAME -->`` and ``<!-- end of NAME -->`` by the table of that result."""
    for path in sorted(folder.glob("*.json")):
        begin, end = f"<!-- {path.stem} -->", f"<!-- end of {path.stem} -->"
        if begin in page and end in page:
            result, machine = read_result(path)
            about = ", ".join(f"{part} {value}" for part, value in machine.items())
            table = f"{as_markdown(result)}\n* Measured on: {about}.\n"
            head, rest = page.split(begin)
            page = f"{head}{begin}\n{table}{end}{rest.split(end)[1]}"
    return page


def write_page(page: Path = PAGE, folder: Path = FOLDER) -> None:
    """Bring the page up to what is saved."""
    page.write_text(with_tables(page.read_text(encoding="utf-8"), folder), encoding="utf-8")

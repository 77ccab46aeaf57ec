import sys
from pathlib import Path

import pytest

from policies.code_digest import PACKAGES, code_digest, imported_files


def test_everything_that_decides_an_episode_counts() -> None:
    names = set(imported_files("policies.table_cell"))
    assert {
        "policies.table_cell",
        "policies.rollout",
        "policies.unpin",
        "envs.step_kernel",
        "envs.scenarios.town_map",
        "safefilter.backends.planar_kernel",
        "safefilter.kinematics.drive_last_word",
        "safefilter",
    } <= names


def test_how_it_is_trained_or_printed_does_not() -> None:
    names = set(imported_files("policies.table_cell"))
    assert not {"policies.trainer", "policies.table_page", "policies.evaluate"} & names


def test_a_change_of_a_file_that_is_imported_changes_it_and_of_another_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "toy"
    package.mkdir()
    for name, text in (
        ("__init__", ""),
        ("first", "from toy import second\n"),
        ("second", "def f():\n    import toy.third\n"),
        ("third", "x = 1\n"),
        ("fourth", "x = 1\n"),
    ):
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("policies.code_digest.PACKAGES", (*PACKAGES, "toy"))
    digests = []
    for name, text in (("fourth", "x = 2\n"), ("third", "x = 2\n"), ("__init__", "y = 1\n")):
        digests.append(code_digest.__wrapped__("toy.first"))
        (package / f"{name}.py").write_text(text)
    digests.append(code_digest.__wrapped__("toy.first"))
    assert digests[0] == digests[1] != digests[2] != digests[3]
    sys.modules.pop("toy", None)

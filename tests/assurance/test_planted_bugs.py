"""Every planted bug is caught, by the check that is named for it; the filter as it is passes them all."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from assurance.planted_bugs import PLANTED_BUGS, PlantedBug
from assurance.properties import COLLISION_FREE, PROPERTIES, Property, first_failure

ROOT = Path(__file__).parents[2]
ROW = re.compile(
    r"^\| (?P<bug>.+?) \| `(?P<check>.+?)` \| (?P<examples>\d+) \| .+ \|$", re.MULTILINE
)


def test_every_planted_bug_is_caught() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "assurance"],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    caught = {row["bug"]: row["check"] for row in ROW.finditer(run.stdout)}
    assert caught == {bug.name: bug.prop.name for bug in PLANTED_BUGS}


def test_there_are_many_and_every_check_catches_one() -> None:
    assert len({bug.name for bug in PLANTED_BUGS}) == len(PLANTED_BUGS) >= 20
    assert {bug.prop.name for bug in PLANTED_BUGS} == {prop.name for prop in PROPERTIES}


@pytest.mark.parametrize("prop", PROPERTIES, ids=lambda prop: prop.name)
def test_the_filter_as_it_is_passes(prop: Property) -> None:
    assert first_failure(prop, most_examples=15) is None


@pytest.mark.parametrize("bug", PLANTED_BUGS, ids=lambda bug: bug.name)
def test_a_bug_is_gone_when_it_is_taken_out(bug: PlantedBug) -> None:
    with bug.planted() as wrong:
        assert wrong is not None
    with bug.planted() as again:
        assert again is not wrong


def test_a_bug_that_nothing_catches_survives() -> None:
    harmless = PlantedBug("harmless", PLANTED_BUGS[0].place, lambda right: right, COLLISION_FREE)
    with harmless.planted():
        assert first_failure(COLLISION_FREE, most_examples=3) is None

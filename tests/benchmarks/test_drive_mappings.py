import pytest

from benchmarks.drive_mappings import DEFAULT, MAPPINGS, SCENARIOS, Driven, drive, measure, row_of
from safefilter import DifferentialDrive
from safefilter.kinematics.differential_drive import Mapping


def test_what_is_compared_with_is_what_drives_do_by_default() -> None:
    drives = DifferentialDrive(0.2, 2.5, 0.2, DEFAULT.tracking_error)
    assert drives.mapping == DEFAULT.mapping
    assert drives.turn_time == pytest.approx(DEFAULT.turn_time)


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_drives_get_through_a_doorway_by_each_mapping(mapping: Mapping) -> None:
    setting = type(DEFAULT)(mapping, 0.02, 0.3)
    driven = drive("doorway, 1 a room", setting, num_seeds=1)
    assert driven.collided == 0
    assert driven.success == 1.0
    assert 15.0 < driven.time < 40.0
    assert 0.0 < driven.intervention < 0.5


def test_a_row_holds_what_came_of_it_in_per_cent() -> None:
    row = row_of("corridor", DEFAULT, Driven(0, 0.5, 30.0, 1.0, 0.25), 20.0)
    assert (row.group, row.name, row.ratio) == ("corridor", "cut, 0.02 m, 0.3 s", 1.5)
    assert row.numbers["arrived"] == 50.0
    assert row.numbers["changed"] == 25.0


@pytest.mark.stress
def test_a_quick_run_compares_the_mappings_in_every_scenario() -> None:
    result = measure(quick=True)
    assert [row.group for row in result.rows] == [name for name in SCENARIOS for _ in MAPPINGS]
    assert all(row.numbers["collided"] == 0.0 for row in result.rows)
    assert [row.ratio for row in result.rows[::2]] == [1.0] * len(SCENARIOS)

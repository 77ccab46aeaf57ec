import pytest

from benchmarks.floor import TOTAL, measure


@pytest.mark.stress  # compiles kernels of its own
def test_stages_add_up_to_the_whole_and_no_floor_is_above_it() -> None:
    result = measure(quick=True)
    taken = {row.name: row.numbers["us a robot"] for row in result.rows}
    assert taken["  Scene.from_world"] + taken["  decide"] == pytest.approx(taken[TOTAL], rel=0.5)
    floors = [row for row in result.rows if row.group == "the floor of one core"]
    assert len(floors) == 3
    assert all(0.0 < row.numbers["us a robot"] < taken[TOTAL] for row in floors)

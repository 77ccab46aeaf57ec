import pytest

from policies.methods import METHODS
from policies.paper_table import FASTER_THAN_NH_ORCA, PAPER_TABLE
from policies.table_scenarios import PAPER_SCENARIOS


def test_rows_are_of_methods_and_scenarios_that_there_are() -> None:
    assert len(PAPER_TABLE) == 16
    assert all(
        scenario in PAPER_SCENARIOS and method in METHODS for scenario, method in PAPER_TABLE
    )


@pytest.mark.parametrize("key", PAPER_TABLE)
def test_shares_of_a_row_sum_to_all_robots(key: tuple[str, str]) -> None:
    row = PAPER_TABLE[key]
    shares = (
        row.success,
        row.collision_robot,
        row.collision_obstacle,
        row.timeout,
        row.rotate_in_place,
    )
    # Printed with one digit.
    assert sum(shares) == pytest.approx(100.0, abs=0.11)


def test_the_gain_that_the_paper_names_is_that_of_its_times() -> None:
    nh, srl = PAPER_TABLE["crossroad", "nh-orca"], PAPER_TABLE["crossroad", "srl-orca"]
    gain = (nh.mean_time - srl.mean_time) / srl.mean_time
    assert gain == pytest.approx(FASTER_THAN_NH_ORCA, abs=5e-4)

from pathlib import Path

from policies.methods import METHODS
from policies.table_cell import Cell
from policies.table_plan import PLAN, cells_of, planned_cells, without_missing
from policies.table_scenarios import TABLE_SCENARIOS

TEMPLATE = Cell(METHODS["nh-orca"], "", episodes=1000, seed=0)


def test_ours_is_driven_everywhere_with_every_training() -> None:
    cells = planned_cells(TEMPLATE, (1, 2, 3))
    ours = {(cell.scenario, cell.training_seed) for cell in cells if cell.method.name == "srl-orca"}
    assert ours == {(scenario, seed) for scenario in TABLE_SCENARIOS for seed in (1, 2, 3)}
    assert {cell.episodes for cell in cells if cell.method.name == "srl-orca"} == {1000}
    assert len(set(cells)) == len(cells)
    assert {cell.method.name for cell in cells} == set(PLAN) == set(METHODS)


def test_trainings_of_others_share_the_episodes_out() -> None:
    cells = [cell for cell in planned_cells(TEMPLATE, (1, 2, 3)) if cell.scenario == "crossroad"]
    episodes = {
        name: [cell.episodes for cell in cells if cell.method.name == name]
        for name in ("nh-orca", "drl-cf")
    }
    assert episodes == {"nh-orca": [1000], "drl-cf": [334] * 3}


def test_what_is_not_learnt_is_driven_once() -> None:
    assert [cell.training_seed for cell in cells_of(TEMPLATE, "nh-orca", "doorway", (1, 2))] == [
        None
    ]


def test_a_training_that_is_missing_is_said_once(tmp_path: Path) -> None:
    template = Cell(METHODS["nh-orca"], "", episodes=1, seed=0, weights=tmp_path)
    cells = [
        cell
        for name in ("nh-orca", "drl-cf", "srl-orca-off")
        for scenario in ("passing", "overtaking")
        for cell in cells_of(template, name, scenario, (98, 99))
    ]
    kept, reasons = without_missing(cells)
    assert [cell.method.name for cell in kept] == ["nh-orca"] * 2
    assert len(reasons) == 4
    assert "python -m policies.train drl-cf --settings.seed 98" in reasons[0]

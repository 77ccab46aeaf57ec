from pathlib import Path

from policies.methods import METHODS
from policies.table_cell import Cell
from policies.table_plan import PLAN, cells_of, planned_cells, shared_out, without_missing
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
    trainings = {"nh-orca": (1,), "drl-cf": (1, 3, 4), "drl-cd": (2,), "srl-orca": (1, 2)}
    cells = [
        cell
        for name, seeds in trainings.items()
        for cell in cells_of(TEMPLATE, name, "crossroad", seeds)
    ]
    episodes = [cell.episodes for cell in shared_out(cells)]
    assert episodes == [1000, *[334] * 3, 1000, 1000, 1000]


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
    assert reasons == [
        f"{name}, training 98, 99: not trained; python -m policies.train {name} --settings.seed 98"
        for name in ("drl-cf", "srl-orca")
    ]

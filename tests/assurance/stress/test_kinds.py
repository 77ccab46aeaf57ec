"""The kinds hold what a campaign must show: sizes, kinematics, priorities, policies, every solver and every fault."""

import numpy as np
import pytest

from assurance.stress.kinds import (
    BY_NAME,
    CROWD_POLICIES,
    Draw,
    faults,
    late_faults,
    solvers,
)
from safefilter.backends.registry import available_backends
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS


def name_of(kind: str, turn: int) -> str:
    size = BY_NAME[kind].size._replace(num_robots=2, most_robots=2)
    return BY_NAME[kind].drive(Draw(np.random.default_rng(turn), turn, 0, size)).name


def test_faults_and_solvers_are_all_that_there_are() -> None:
    assert set(faults()) == set(FAULTS)
    assert set(late_faults()) == set(FAULTS_IN_A_PROCESS)
    others = set(available_backends()) - {"planar", *FAULTS, *FAULTS_IN_A_PROCESS}
    assert set(solvers()) == others
    assert {"osqp", "clarabel"} <= others


@pytest.mark.parametrize(
    ("kind", "names"), [("faulty solvers", faults), ("crowds", lambda: ("planar",))]
)
def test_every_backend_meets_every_policy(kind: str, names: object) -> None:
    assert callable(names)
    wanted = {(name, policy) for name in names() for policy in CROWD_POLICIES}
    drawn = {tuple(name_of(kind, turn).split(", ")[:2]) for turn in range(2 * len(wanted))}
    assert drawn == wanted


@pytest.mark.parametrize("kind", ["holonomic", "drives"])
def test_worlds_go_through_every_combination(kind: str) -> None:
    names = {name_of(kind, turn).rpartition(",")[0] for turn in range(64)}
    # Holonomic robots have no mapping of velocities to commands to go through.
    assert len(names) == (64 if kind == "drives" else 32)
    assert {name.split(", ")[3] for name in names} == {"0 beams"}


def test_lidars_are_all_that_some_worlds_know_walls_by() -> None:
    assert "360 beams" in name_of("drives, lidar", 0)
    assert "360 beams" in name_of("holonomic, lidar", 0)


def test_worlds_hold_up_to_two_hundred_robots() -> None:
    names = [
        BY_NAME["holonomic"]
        .drive(Draw(np.random.default_rng(turn), turn, 0, BY_NAME["holonomic"].size))
        .name
        for turn in range(60)
    ]
    sizes = [int(name.rpartition(" ")[2]) for name in names]
    assert min(sizes) == 2
    assert 150 < max(sizes) <= 200

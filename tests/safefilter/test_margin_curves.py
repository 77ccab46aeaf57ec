import json
import math
from pathlib import Path

import numpy as np
import pytest

from safefilter.closest_approach import CONTACT_TOLERANCE
from safefilter.testing import margin_curves
from safefilter.testing.margin_curves import (
    DT,
    RATIOS,
    REAL,
    V_MAX,
    cell_of,
    cross,
    crossing,
    encounter,
    least_clearance,
    main,
    safety_filter_of,
    uncertainty_of,
)
from safefilter.uncertainty import EXACT, Uncertainty

SEEDS = range(20)


def met(error: str, stated: float) -> list[float]:
    """Least clearances of encounters in which an error is real, and that much of it is stated."""
    safety = safety_filter_of(error, uncertainty_of(error, stated), has_orca=False)
    actual = uncertainty_of(error, float(REAL[error]))
    return [least_clearance(safety, encounter(error, actual, seed)) for seed in SEEDS]


@pytest.mark.parametrize("error", REAL)
def test_with_the_bound_respected_nobody_collides_and_with_it_exceeded_somebody_does(
    error: str,
) -> None:
    real = float(REAL[error])
    assert min(met(error, real)) >= -CONTACT_TOLERANCE
    assert min(met(error, real / 3.0)) < -CONTACT_TOLERANCE


def test_every_bound_has_its_curve() -> None:
    assert set(REAL) == set(Uncertainty.__slots__)
    assert {0.0, 0.5, 1.0, 2.0} == set(RATIOS)


def test_one_error_at_a_time() -> None:
    assert uncertainty_of("lost_messages", 1.0).lost_messages == 1
    assert uncertainty_of("clock_jitter", 0.1) == Uncertainty(clock_jitter=0.1)
    assert uncertainty_of("clock_jitter", 0.0) == EXACT


def test_arrivals_are_timed_by_step() -> None:
    trial = crossing("position_error", EXACT, 0)
    safety = safety_filter_of("position_error", EXACT, has_orca=True)
    clearance, arrival = cross(safety, trial)
    straight = 2.0 * margin_curves.CROSSING_RADIUS / V_MAX
    assert clearance >= 0.0
    assert np.isfinite(arrival).all()
    assert arrival.min() >= straight - margin_curves.ARRIVED / V_MAX - DT
    assert arrival == pytest.approx(np.round(arrival / DT) * DT)


def test_a_cell_counts_what_happened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(margin_curves, "CROSSING_STEPS", 3)
    cell = cell_of("position_error", 0.0, encounters=3, crossings=1, seed=0)
    assert cell.collisions == 3
    assert -0.08 < cell.clearance < 0.0
    # Nobody gets across in three steps, which count with their limit.
    assert cell.arrived == 0.0
    assert cell.time_to_goal == pytest.approx(3 * DT)
    assert math.isfinite(cell.crossing_clearance)


def test_the_command_writes_figures_and_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(margin_curves, "REAL", {"position_error": 0.02})
    monkeypatch.setattr(margin_curves, "CROSSING_STEPS", 2)
    given = ["--out", str(tmp_path), "--encounters", "2", "--crossings", "1", "--seed", "5"]
    assert main(given) == 0
    found = json.loads((tmp_path / "margins.json").read_text(encoding="utf-8"))
    assert found["settings"] == {"encounters": 2, "crossings": 1, "seed": 5}
    assert [cell["ratio"] for cell in found["cells"]] == list(RATIOS)
    assert (tmp_path / "margins.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(RATIOS)


def test_a_collision_within_the_bound_fails_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(margin_curves, "REAL", {"position_error": 0.02})
    monkeypatch.setattr(margin_curves, "CROSSING_STEPS", 2)
    # As if nothing were stated, whatever is.
    monkeypatch.setattr(margin_curves, "RATIOS", (1.0,))
    alone = safety_filter_of("position_error", EXACT, has_orca=False)
    monkeypatch.setattr(margin_curves, "safety_filter_of", lambda *_, **__: alone)
    assert main(["--out", str(tmp_path), "--encounters", "2", "--crossings", "1"]) == 1

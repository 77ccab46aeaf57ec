"""What a robot met is written while it drives, and is what the solver was asked."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem_file import read_problems
from safefilter.comparison.recording import Recorder, posed_problems
from safefilter.errors import InvalidInput
from safefilter.wrappers import SafeAction

V_MAX, DT, RADIUS = 0.2, 0.2, 0.1


class Street(gymnasium.Env[npt.NDArray[np.float32], npt.NDArray[np.floating]]):
    """A robot, and two parked ones in its way."""

    action_space = gymnasium.spaces.Box(-V_MAX, V_MAX, (2,))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))

    def __init__(self) -> None:
        self.position = np.zeros(2)

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, object]]:
        super().reset(seed=seed, options=options)
        self.position = np.zeros(2)
        return self.position.astype(np.float32), {}

    def step(
        self, action: npt.NDArray[np.floating]
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, object]]:
        self.position = self.position + DT * action
        return self.position.astype(np.float32), 0.0, False, False, {}

    def scene(self) -> sf.Scene:
        position = np.array([self.position, [0.6, 0.05], [0.6, -0.3]])
        still = np.zeros((3, 2))
        return sf.Scene.from_world(position, still, RADIUS, cooperative=[True, False, False])


def safety() -> sf.SafetyFilter:
    return sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(V_MAX))


def drive(
    env: gymnasium.Env[npt.NDArray[np.float32], npt.NDArray[np.floating]],
) -> list[FloatArray]:
    """Two episodes straight ahead; what executed where the filter intervened."""
    executed = []
    for _ in range(2):
        env.reset(seed=0)
        for _ in range(12):
            info = env.step(np.array([V_MAX, 0.0], dtype=np.float32))[4]["safefilter"]
            if info["case"] != sf.Case.SAFE:
                executed.append(info["action"].astype(np.float64))
    return executed


def test_what_is_recorded_has_the_answers_that_executed(tmp_path: Path) -> None:
    path = tmp_path / "street.jsonl"
    env = SafeAction(Street(), safety(), record=path)
    executed = drive(env)
    env.close()
    recorded = read_problems(path)
    assert len(executed) == len(recorded) > 5
    for problem, action in zip(recorded.problems, executed, strict=True):
        assert (problem.scale, problem.dimension) == (V_MAX, 2)
        # float32 rounds the action by 1e-8 m/s.
        np.testing.assert_allclose(truth_of(problem, 1e-9).point, action, atol=3e-8)
    assert {problem.sequence for problem in recorded.problems} == {
        "episode 1, robot 0",
        "episode 2, robot 0",
    }


def test_recording_changes_nothing(tmp_path: Path) -> None:
    plain = drive(SafeAction(Street(), safety()))
    recorded = drive(SafeAction(Street(), safety(), record=tmp_path / "street.jsonl"))
    assert np.array_equal(plain, recorded)


def test_what_was_written_before_a_crash_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "street.jsonl"
    drive(SafeAction(Street(), safety(), record=path))
    # Not closed. And the last line is cut off.
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:-30], encoding="utf-8")
    assert len(read_problems(path)) == text.count("\n") - 2


def test_a_file_that_exists_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "mine.jsonl"
    path.write_text("precious", encoding="utf-8")
    with pytest.raises(InvalidInput, match="exists already; move it away, or choose another name"):
        SafeAction(Street(), safety(), record=path)
    assert path.read_text(encoding="utf-8") == "precious"


def test_a_missing_folder_is_found_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no folder"):
        Recorder(tmp_path / "nowhere" / "street.jsonl")


def test_no_file_is_made_where_no_solver_was_needed(tmp_path: Path) -> None:
    path = tmp_path / "street.jsonl"
    env = SafeAction(Street(), safety(), record=path)
    env.reset(seed=0)
    env.step(np.zeros(2, dtype=np.float32))
    env.close()
    assert not path.exists()


def test_problems_of_a_box_are_in_its_unit() -> None:
    space = gymnasium.spaces.Box(-1000.0, 1000.0, (3,), dtype=np.float64)
    rows = sf.LinearConstraint([[0.6, 0.8, 0.0]], [300.0], hard=True)
    safety_filter = sf.SafetyFilter([rows], sf.Box(space), backend="clarabel")
    action = np.zeros((1, 3))
    decision = safety_filter.decide(None, action)
    (problem,) = posed_problems(safety_filter, None, action, decision)
    assert problem.scale == pytest.approx(1000.0 / 1024.0)
    assert problem.hard.all()
    point = 1024.0 * truth_of(problem, 1e-9).point
    np.testing.assert_allclose(point, [180.0, 240.0, 0.0], atol=1e-9)


def test_a_wish_that_is_not_finite_is_recorded_as_standing_still(tmp_path: Path) -> None:
    path = tmp_path / "street.jsonl"
    env = SafeAction(Street(), safety(), record=path)
    env.reset(seed=0)
    env.step(np.array([np.nan, 0.0], dtype=np.float32))
    env.close()
    # Standing still is safe here: no solver was needed.
    assert not path.exists()

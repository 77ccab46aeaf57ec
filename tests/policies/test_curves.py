import json
from pathlib import Path

import numpy as np
import pytest

from policies.curves import Curve, Settings, on_common_steps, read_curves, write_curves
from safefilter.errors import InvalidInput


def _keep(runs: Path, name: str, seed: int, values: list[float]) -> None:
    folder = runs / f"{name}-{seed}"
    folder.mkdir(parents=True)
    points = [{"num_steps": 100.0 * (k + 1), "reward": value} for k, value in enumerate(values)]
    points[-1]["success/x"] = 0.5
    (folder / "curve.json").write_text(json.dumps(points))


def test_all_seeds_of_a_training_and_no_others_are_read(tmp_path: Path) -> None:
    _keep(tmp_path, "drl-cf", 1, [1.0])
    _keep(tmp_path, "drl-cf", 22, [2.0])
    _keep(tmp_path, "drl-cf-sparse", 1, [3.0])
    rewards = [points[0]["reward"] for points in read_curves("drl-cf", tmp_path)]
    assert rewards == [1.0, 2.0]


def test_points_without_the_figure_are_left_out(tmp_path: Path) -> None:
    _keep(tmp_path, "a", 1, [1.0, 2.0, 3.0])
    (points,) = read_curves("a", tmp_path)
    curve = Curve.of(points, "success/x")
    assert curve.num_steps.tolist() == [300.0]
    assert curve.value.tolist() == [0.5]
    with pytest.raises(
        InvalidInput, match="figure 'loss': expected one of num_steps, reward, success/x"
    ):
        Curve.of(points, "loss")


def test_curves_are_read_where_all_of_them_are_known() -> None:
    first = Curve(np.array([0.0, 10.0]), np.array([0.0, 10.0]))
    second = Curve(np.array([5.0, 20.0]), np.array([1.0, 1.0]))
    steps, values = on_common_steps([first, second])
    assert (steps[0], steps[-1]) == (5.0, 10.0)
    np.testing.assert_allclose(values[0], steps)
    np.testing.assert_allclose(values[1], 1.0)


def test_a_training_that_is_not_there_names_the_command(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"train with python -m policies.train drl-cd"):
        read_curves("drl-cd", tmp_path)


def test_a_picture_comes_of_it(tmp_path: Path) -> None:
    for seed in (1, 2):
        _keep(tmp_path, "a", seed, [1.0, 2.0, float(seed)])
    out = tmp_path / "deep" / "curves.png"
    write_curves(Settings(("a",), ("reward",), runs=tmp_path, out=out))
    assert out.read_bytes().startswith(b"\x89PNG")

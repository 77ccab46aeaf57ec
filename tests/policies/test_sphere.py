"""Drones that cross a sphere: where they start, that all arrive, and what the command says and returns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from policies import sphere as command
from policies.sphere import DT, RADIUS, V_MAX, Settings, fly, main, sphere, to_goals


def test_points_lie_on_the_sphere_with_room_between_them() -> None:
    points = sphere(100)
    radius = np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(radius, radius[0])
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(distance, np.inf)
    assert distance.min() > 4.0 * RADIUS
    # Spread evenly: they balance.
    assert float(np.linalg.norm(points.mean(axis=0))) < 0.01 * radius[0]


def test_wishes_point_to_goals_and_end_there() -> None:
    position = np.zeros((2, 3))
    goal = np.array([[0.0, 0.0, 100.0], [0.1, 0.0, 0.0]])
    np.testing.assert_allclose(to_goals(position, goal), [[0, 0, V_MAX], [0.1 / DT, 0, 0]])


def test_all_arrive_and_nobody_collides() -> None:
    flight = fly(30, seed=0)
    assert flight.has_arrived.all()
    assert flight.collisions == 0
    assert flight.uncertified == 0
    assert flight.clearance >= 0.0
    assert min(flight.cases) > 0
    assert (flight.arrival >= flight.straight_time - 2.0 * DT).all()
    # Those who are there give way to those who are not, yet.
    np.testing.assert_allclose(flight.track[-1], -flight.track[0], atol=3.0 * RADIUS)
    assert len(flight.track) == round(float(flight.arrival.max()) / DT) + 1


def test_the_judge_sees_drones_that_meet() -> None:
    position = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.2], [90.0, 0.0, 0.0]])
    approach = command._judge(position, np.array([[0.0, 0.0, 0.2], [0.0, 0.0, -0.2], [0, 0, 0]]))
    assert approach.collided.tolist() == [True]


def test_the_command_prints_a_line_a_flight_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "sphere.png"
    assert main(Settings((8, 12), picture=picture)) == 0
    _, first, second = capsys.readouterr().out.splitlines()
    assert first.split()[:4:2] == ["8", "0"]
    assert second.split()[:4:2] == ["12", "0"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_flight_that_is_given_up_says_who_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    flight = fly(8, seed=0, max_steps=2)
    assert not flight.has_arrived.any()
    assert len(flight.track) == 3
    assert " 0 " in command._row(flight)
    assert capsys.readouterr().err == ""

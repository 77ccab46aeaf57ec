"""Half-planes of pairs: shared out by priority, safe for the horizon, and cut to the most urgent neighbours."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from safefilter import DifferentialDrive, SafetyFilter
from safefilter.arrays import FloatArray
from safefilter.constraints.priority_orca import (
    Leg,
    PriorityORCA,
    SlackRule,
    VOpt,
)
from safefilter.constraints.urgency import time_to_collision
from safefilter.errors import InvalidInput, NotFinite, OutOfRange
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene

SAFE_V_OPTS = ("current", "shared")
BOTH = np.arange(2)


@dataclass(frozen=True)
class Meeting:
    """Two robots that do not overlap, and what they want."""

    position: list[list[float]]
    velocity: list[list[float]]
    radius: list[float]
    wanted: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0], [0.0, 0.0]])
    priority: list[float] = field(default_factory=lambda: [1.0, 1.0])
    cooperative: list[bool] = field(default_factory=lambda: [True, True])

    @property
    def scene(self) -> Scene:
        return Scene.from_world(
            self.position,
            self.velocity,
            self.radius,
            priority=self.priority,
            cooperative=self.cooperative,
            wanted=self.wanted,
        )

    def rows(self, orca: PriorityORCA) -> HalfSpaces:
        return orca.half_spaces(self.scene, np.array(self.wanted), BOTH)

    @property
    def scale(self) -> float:
        """Lengths and speeds in play: what rounding is measured against."""
        numbers = [*self.position, *self.velocity, *self.wanted, self.radius]
        return 1.0 + max(abs(number) for row in numbers for number in row)


def least_distance(meeting: Meeting, velocity: FloatArray, duration: float) -> float:
    """Least distance of centres while both keep their velocities."""
    p = np.subtract(meeting.position[1], meeting.position[0])
    v = velocity[1] - velocity[0]
    speed_squared = float(v @ v)
    time = min(max(-float(p @ v) / speed_squared, 0.0), duration) if speed_squared else 0.0
    return float(np.linalg.norm(p + v * time))


def permitted(rows: HalfSpaces, robot: int, outwards: float, sideways: float) -> FloatArray:
    """A velocity within the robot's one half-plane."""
    n_x, n_y = rows.normals[robot, 0]
    along = rows.offsets[robot, 0] + outwards
    return np.array([along * n_x - sideways * n_y, along * n_y + sideways * n_x])


# Inside by any amount, often on the very edge.
outwards = st.one_of(st.just(0.0), st.floats(0.0, 2.0))
sideways = st.floats(-2.0, 2.0)
speeds = st.one_of(st.sampled_from((0.0, 1.0, -1.0)), st.floats(-1.5, 1.5))
vectors = st.lists(speeds, min_size=2, max_size=2)
radii = st.floats(0.05, 0.5)
priorities = st.floats(1e-3, 1e3)
horizons = st.floats(0.2, 5.0)


@st.composite
def meetings(draw: st.DrawFn) -> Meeting:
    radius = [draw(radii), draw(radii)]
    distance = sum(radius) * (1.0 + draw(st.floats(1e-3, 10.0)))
    angle, centre = draw(st.floats(0.0, 6.3)), [draw(speeds), draw(speeds)]
    other = [centre[0] + distance * math.cos(angle), centre[1] + distance * math.sin(angle)]
    return Meeting(
        position=[centre, other],
        velocity=[draw(vectors), draw(vectors)],
        radius=radius,
        wanted=[draw(vectors), draw(vectors)],
        priority=[draw(priorities), draw(priorities)],
    )


@st.composite
def settings_of_orca(draw: st.DrawFn, v_opts: tuple[str, ...] = SAFE_V_OPTS) -> dict[str, Any]:
    return {
        "time_horizon": draw(horizons),
        "v_opt": draw(st.sampled_from(v_opts)),
        "slack_rule": draw(st.sampled_from(get_args(SlackRule))),
        "leg": draw(st.sampled_from(get_args(Leg))),
    }


# Two robots 4 m apart drive at each other with 0.875 m/s each; combined radius 1 m, horizon 2 s: the relative velocity
# 1.75 m/s lies in the cut-off disc around 2 m/s of radius 0.5 m/s, and leaves it by a change of 0.25 m/s.
HEAD_ON = Meeting([[0.0, 0.0], [4.0, 0.0]], [[0.875, 0.0], [-0.875, 0.0]], [0.5, 0.5])


def test_head_on_rows_by_hand() -> None:
    rows = HEAD_ON.rows(PriorityORCA(2.0))
    assert rows.normals[:, 0].tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    assert rows.offsets[:, 0].tolist() == [-0.75, -0.75]
    assert not rows.hard.any()
    assert rows.present.all()
    assert [rows.describe(b, 0) for b in range(2)] == ["priority_orca 1", "priority_orca 0"]


@pytest.mark.parametrize(
    ("priority", "expected"), [([3.0, 1.0], [-0.8125, -0.6875]), ([1.0, 3.0], [-0.6875, -0.8125])]
)
def test_higher_priority_gives_way_less_by_hand(
    priority: list[float], expected: list[float]
) -> None:
    meeting = Meeting(HEAD_ON.position, HEAD_ON.velocity, HEAD_ON.radius, priority=priority)
    assert meeting.rows(PriorityORCA(2.0)).offsets[:, 0].tolist() == expected


def test_all_of_the_change_is_taken_from_a_robot_that_does_not_cooperate() -> None:
    meeting = Meeting(
        HEAD_ON.position,
        HEAD_ON.velocity,
        HEAD_ON.radius,
        cooperative=[True, False],
        priority=[9.0, 1.0],
    )
    assert meeting.rows(PriorityORCA(2.0)).offsets[0, 0] == -0.625


@pytest.mark.parametrize(
    ("velocity", "nearest", "norm"),
    [
        pytest.param([[1.0, 0.25], [-1.0, -0.25]], 0.8, -0.8, id="head-on: on the right"),
        pytest.param([[3.0, -0.25], [1.0, 0.25]], -0.8, 0.8, id="same heading: on the left"),
        pytest.param([[2.0, 0.0], [0.0, 0.5]], -0.8, -0.8, id="crossing: the nearest side"),
    ],
)
def test_leg_is_chosen_as_asked_for(
    velocity: list[list[float]], nearest: float, norm: float
) -> None:
    # Legs of discs with sides 3, 4, 5.
    meeting = Meeting([[0.0, 0.0], [5.0, 0.0]], velocity, [1.0, 2.0])
    for leg, n_y in (("nearest", nearest), ("norm", norm)):
        rows = meeting.rows(PriorityORCA(5.0, leg=leg))  # type: ignore[arg-type]  # a Leg
        np.testing.assert_allclose(rows.normals[:, 0], [[-0.6, n_y], [0.6, -n_y]], atol=1e-15)


@given(
    meeting=meetings(),
    options=settings_of_orca(),
    mine=st.tuples(outwards, sideways),
    theirs=st.tuples(outwards, sideways),
)
def test_pair_of_permitted_velocities_never_touches_within_the_horizon(
    meeting: Meeting,
    options: dict[str, Any],
    mine: tuple[float, float],
    theirs: tuple[float, float],
) -> None:
    rows = meeting.rows(PriorityORCA(**options))
    velocity = np.stack([permitted(rows, 0, *mine), permitted(rows, 1, *theirs)])
    nearest = least_distance(meeting, velocity, options["time_horizon"])
    assert nearest >= sum(meeting.radius) - 1e-7 * meeting.scale


@given(meeting=meetings(), options=settings_of_orca(), mine=st.tuples(outwards, sideways))
def test_one_robot_avoids_another_that_keeps_its_velocity(
    meeting: Meeting, options: dict[str, Any], mine: tuple[float, float]
) -> None:
    assume(options["v_opt"] == "current")
    alone = Meeting(
        meeting.position,
        meeting.velocity,
        meeting.radius,
        meeting.wanted,
        cooperative=[True, False],
    )
    rows = alone.rows(PriorityORCA(**options))
    velocity = np.stack([permitted(rows, 0, *mine), np.array(meeting.velocity[1])])
    nearest = least_distance(alone, velocity, options["time_horizon"])
    assert nearest >= sum(alone.radius) - 1e-7 * alone.scale


def test_own_wanted_against_seen_velocities_is_not_safe() -> None:
    rng = np.random.default_rng(0)
    touching = 0
    for _ in range(200):
        velocity, wanted = rng.uniform(-1.0, 1.0, (2, 2, 2))
        meeting = Meeting([[0.0, 0.0], [1.0, 0.5]], velocity.tolist(), [0.2, 0.2], wanted.tolist())
        rows = meeting.rows(PriorityORCA(2.0, v_opt="own"))
        both = np.stack([permitted(rows, robot, 0.0, rng.uniform(-1.0, 1.0)) for robot in range(2)])
        touching += least_distance(meeting, both, 2.0) < 0.4 - 1e-3
    assert touching > 0


@given(meeting=meetings(), options=settings_of_orca())
def test_both_robots_get_opposite_normals(meeting: Meeting, options: dict[str, Any]) -> None:
    rows = meeting.rows(PriorityORCA(**options))
    assert rows.normals[0, 0].tolist() == (-rows.normals[1, 0]).tolist()


@given(meeting=meetings(), options=settings_of_orca(get_args(VOpt)), x=speeds, y=speeds)
def test_moving_frame_of_reference_moves_the_half_plane(
    meeting: Meeting, options: dict[str, Any], x: float, y: float
) -> None:
    assume(options["leg"] == "nearest")
    shift = np.array([x, y])
    moved = Meeting(
        meeting.position,
        (np.array(meeting.velocity) + shift).tolist(),
        meeting.radius,
        (np.array(meeting.wanted) + shift).tolist(),
        meeting.priority,
    )
    orca = PriorityORCA(**options)
    before, after = meeting.rows(orca), moved.rows(orca)
    # On the axis and at the centre the nearest side is a matter of rounding.
    assume(np.abs(before.normals - after.normals).max() < 0.1)
    expected = before.offsets[:, 0] + after.normals[:, 0] @ shift
    blur = 1e-6 * meeting.scale
    np.testing.assert_allclose(
        after.offsets[:, 0],
        expected,
        atol=blur + 3.0 * np.abs(before.normals - after.normals).max(),
    )


@given(meeting=meetings())
def test_current_velocities_make_wants_irrelevant(meeting: Meeting) -> None:
    still = Meeting(
        meeting.position, meeting.velocity, meeting.radius, [[0.0, 0.0]] * 2, meeting.priority
    )
    one, other = meeting.rows(PriorityORCA(2.0)), still.rows(PriorityORCA(2.0))
    np.testing.assert_array_equal(one.offsets, other.offsets)


@given(meeting=meetings())
def test_shared_wants_are_what_current_is_for_robots_that_have_them(meeting: Meeting) -> None:
    moving = Meeting(
        meeting.position, meeting.wanted, meeting.radius, meeting.wanted, meeting.priority
    )
    shared = meeting.rows(PriorityORCA(2.0, v_opt="shared"))
    current = moving.rows(PriorityORCA(2.0))
    own = moving.rows(PriorityORCA(2.0, v_opt="own"))
    for other in (current, own):
        np.testing.assert_array_equal(shared.normals, other.normals)
        np.testing.assert_array_equal(shared.offsets, other.offsets)


def test_shared_wants_must_be_known() -> None:
    scene = Scene.from_world(HEAD_ON.position, HEAD_ON.velocity, 0.5)
    with pytest.raises(InvalidInput) as caught:
        PriorityORCA(2.0, v_opt="shared").half_spaces(scene, np.zeros((2, 2)), BOTH)
    assert str(caught.value) == (
        'v_opt="shared" needs the wanted velocities of all robots: pass wanted= to Scene.from_world'
    )


def test_overlapping_robots_part_within_the_overlap_time() -> None:
    # 0.4 m too close, at rest: 0.4 m in 0.5 s, shared by two.
    meeting = Meeting([[0.0, 0.0], [0.6, 0.0]], [[0.0, 0.0], [0.0, 0.0]], [0.5, 0.5])
    rows = meeting.rows(PriorityORCA(2.0, overlap_time=0.5))
    assert rows.normals[:, 0].tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    np.testing.assert_allclose(rows.offsets[:, 0], [0.4, 0.4], rtol=1e-12)


@given(meeting=meetings())
@example(meeting=HEAD_ON)
def test_discs_touch_at_the_time_to_collision_and_not_before(meeting: Meeting) -> None:
    p = np.subtract(meeting.position[1], meeting.position[0])
    v = np.subtract(meeting.velocity[0], meeting.velocity[1])
    radius = sum(meeting.radius)
    time = time_to_collision(p[0], p[1], v[0], v[1], radius)
    velocity = np.array(meeting.velocity)
    # A speed whose square vanishes gives a time that means never, too.
    if time >= 1e6:
        assert least_distance(meeting, velocity, 1e6) >= radius - 1e-7 * meeting.scale
    else:
        assert least_distance(meeting, velocity, time) == pytest.approx(radius, abs=1e-6)
        assert float(np.linalg.norm(p - time * v)) == pytest.approx(radius, abs=1e-6)


@given(meeting=meetings(), error=st.floats(1e-3, 0.1))
def test_robots_that_track_with_an_error_are_that_much_larger(
    meeting: Meeting, error: float
) -> None:
    gap = math.dist(*meeting.position) - sum(meeting.radius)
    assume(gap > 3.0 * error)
    drive = DifferentialDrive(1.0, 1.0, 0.1, error)
    tracked = Scene.from_world(
        meeting.position, meeting.velocity, meeting.radius, heading=0.0, priority=meeting.priority
    )
    rows = SafetyFilter([PriorityORCA(2.0)], drive).half_spaces(tracked, np.zeros((2, 2)))
    larger = [radius + error for radius in meeting.radius]
    grown = Meeting(
        meeting.position, meeting.velocity, larger, meeting.wanted, meeting.priority
    ).rows(PriorityORCA(2.0))
    soft = rows.present & ~rows.hard
    assert soft.sum(axis=1).tolist() == [1, 1]
    # Rounding of the radius decides the side where both are as near.
    assume(np.abs(rows.normals[soft] - grown.normals[:, 0]).max() < 0.1)
    np.testing.assert_allclose(rows.offsets[soft], grown.offsets[:, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"time_horizon": 0.0}, OutOfRange, "time_horizon: expected a number above 0, got 0.0"),
        ({"time_horizon": math.nan}, NotFinite, "time_horizon: expected a finite number, got nan"),
        ({"overlap_time": -1.0}, OutOfRange, "overlap_time: expected a number above 0, got -1.0"),
        ({"max_neighbours": -1}, OutOfRange, "max_neighbours: expected at least 0, got -1"),
        (
            {"v_opt": "mine"},
            InvalidInput,
            "v_opt: expected one of current, shared, own, got 'mine'",
        ),
        ({"slack_rule": ""}, InvalidInput, "slack_rule: expected one of dual, paper, got ''"),
        ({"leg": "left"}, InvalidInput, "leg: expected one of nearest, norm, got 'left'"),
        (
            {"order": "age"},
            InvalidInput,
            "order: expected one of time_to_collision, distance, got 'age'",
        ),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    options: dict[str, Any], error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        PriorityORCA(**{"time_horizon": 2.0, **options})
    assert str(caught.value) == message

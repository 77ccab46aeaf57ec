from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.wrappers.decision_info import FIELDS
from safefilter.wrappers.lanes import Lanes

FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.StaticObstacles(1.0), sf.Separation(0.2)], sf.Holonomic(0.2)
)
WALL = [[[-1.0, 0.5], [1.0, 0.5]]]
OTHER_WALL = [[[-1.0, -0.5], [1.0, -0.5]], [[0.9, -1.0], [0.9, 1.0]]]


def crowd(seed: int, num_robots: int, **fields: Any) -> sf.Scene:
    rng = np.random.default_rng(seed)
    return sf.Scene.from_world(
        rng.uniform(-0.8, 0.8, (num_robots, 2)),
        rng.uniform(-0.14, 0.14, (num_robots, 2)),
        rng.uniform(0.05, 0.15, num_robots),
        priority=rng.uniform(0.5, 2.0, num_robots),
        **fields,
    )


def require_same_decisions(lanes: Lanes, scenes: list[sf.Scene]) -> None:
    """Decide for all at once and for each lane alone."""
    rng = np.random.default_rng(1)
    wanted = rng.uniform(-0.2, 0.2, (len(lanes.robots), 2))
    together = FILTER.decide(lanes.scene, wanted, lanes.robots)
    for lane, scene in enumerate(scenes):
        rows = slice(lanes.start[lane], lanes.start[lane + 1])
        alone = FILTER.decide(scene, wanted[rows], np.arange(scene.num_robots))
        for field in ("action", "velocity", *FIELDS):
            found, expected = getattr(together, field)[rows], getattr(alone, field)
            assert found.tobytes() == expected.tobytes(), (field, lane)


@given(
    st.lists(st.tuples(st.integers(0, 999), st.integers(1, 5)), min_size=1, max_size=4),
    st.sampled_from([None, 1.2]),
    st.lists(st.sampled_from([None, WALL, OTHER_WALL]), min_size=4, max_size=4),
)
def test_lanes_decide_together_as_each_alone_bit_for_bit(
    crowds: list[tuple[int, int]], reach: float | None, walls: list[Any]
) -> None:
    scenes = [
        crowd(seed, num_robots, reach=reach, walls=known)
        for (seed, num_robots), known in zip(crowds, walls, strict=False)
    ]
    lanes = Lanes.stacked(scenes)
    assert lanes.sizes.tolist() == [num_robots for _, num_robots in crowds]
    require_same_decisions(lanes, scenes)


def test_one_map_for_all_lanes_stays_one_map() -> None:
    scene = Lanes.stacked([crowd(0, 2, walls=WALL), crowd(1, 3, walls=WALL)]).scene
    assert scene.num_shared_walls == len(scene.walls) == 1


def test_walls_that_each_robot_has_scanned_stay_its_own() -> None:
    lidars = [sf.Lidar.scan(np.full((n, 32), distance)) for n, distance in ((2, 0.4), (1, 0.3))]
    scenes = [
        crowd(0, 2, heading=[0.0, 1.0], lidar=lidars[0], walls=WALL),
        crowd(1, 1, heading=[2.0], lidar=lidars[1], walls=WALL),
    ]
    require_same_decisions(Lanes.stacked(scenes), scenes)


def test_worlds_of_one_scene_are_lanes_in_any_order() -> None:
    world = np.array([2, 0, 2, 0, 2])
    everyone = crowd(3, 5, world=world)
    lanes = Lanes.of_worlds(everyone, 3)
    assert lanes.robots.tolist() == [1, 3, 0, 2, 4]
    assert lanes.sizes.tolist() == [2, 0, 3]
    parts = [np.flatnonzero(world == lane) for lane in range(3)]
    scenes = [
        sf.Scene.from_world(
            everyone.position[part],
            everyone.velocity[part],
            everyone.radius[part],
            priority=everyone.priority[part],
        )
        for part in parts
    ]
    require_same_decisions(lanes, scenes)


def test_worlds_within_lanes_stay_apart() -> None:
    lanes = Lanes.stacked([crowd(0, 3, world=[0, 7, 7]), crowd(1, 2)])
    assert lanes.scene.world.tolist() == [0, 1, 1, 2, 2]


@pytest.mark.parametrize("world", [[0, 2], [-1, 0]])
def test_world_without_a_lane_is_refused(world: list[int]) -> None:
    with pytest.raises(OutOfRange, match=r"needs world=, .* 0 to 1; got"):
        Lanes.of_worlds(crowd(0, 2, world=world), 2)


@pytest.mark.parametrize(
    ("field", "value"), [("heading", [0.0, 0.0]), ("wanted", [[0.0, 0.0], [0.0, 0.0]])]
)
def test_what_only_some_lanes_know_is_refused(field: str, value: Any) -> None:
    with pytest.raises(InvalidInput, match=f"{field}= is given in some environments only"):
        Lanes.stacked([crowd(0, 2, **{field: value}), crowd(1, 2)])


def test_what_all_lanes_know_is_stacked() -> None:
    scenes = [
        crowd(0, 1, heading=[0.5], wanted=[[0.1, 0.0]]),
        crowd(1, 1, heading=[0.7], wanted=[[0.0, 0.1]]),
    ]
    scene = Lanes.stacked(scenes).scene
    assert scene.heading.tolist() == [0.5, 0.7]
    assert scene.wanted.tolist() == [[0.1, 0.0], [0.0, 0.1]]


def test_scenes_that_know_no_robots_have_an_entry_a_lane() -> None:
    lanes = Lanes.of_entries("anything", 3)
    assert lanes.scene == "anything"
    assert lanes.sizes.tolist() == [1, 1, 1]


def test_lanes_may_be_about_robots_that_share_worlds() -> None:
    everyone = crowd(3, 6, world=[0, 0, 0, 5, 5, 5])
    lanes = Lanes.of_robots(everyone, np.array([0, 2, 3, 5]), 4)
    assert lanes.sizes.tolist() == [1, 1, 1, 1]
    assert lanes.robots.tolist() == [0, 2, 3, 5]
    # Those without a lane are still there for the others to see.
    assert lanes.scene is everyone


@pytest.mark.parametrize(
    ("robots", "message"),
    [
        ([0, 1], r"robot_of_lane: expected shape \(3,\), got \(2,\)"),
        ([0, 1, 4], "expected different robots 0 to 3, got"),
        ([-1, 1, 2], "expected different robots 0 to 3, got"),
        ([0, 1, 1], "expected different robots 0 to 3, got"),
    ],
)
def test_lanes_without_a_robot_each_are_refused(robots: list[int], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        Lanes.of_robots(crowd(0, 4), np.array(robots), 3)

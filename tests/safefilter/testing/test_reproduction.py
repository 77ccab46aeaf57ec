import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import array_code
from safefilter.scene import Scene
from safefilter.testing.strategies import scenes


def same(one: Scene, other: Scene) -> bool:
    return (
        np.array_equal(one.state, other.state)
        and np.array_equal(one.cooperative, other.cooperative)
        and np.array_equal(one.world, other.world)
        and one.has_wanted == other.has_wanted
        and one.reach == other.reach
        and np.array_equal(one.neighbours, other.neighbours)
    )


@given(scenes())
def test_a_scene_is_written_as_the_code_that_makes_it_bit_for_bit(scene: Scene) -> None:
    assert same(eval(repr(scene), {"Scene": Scene}), scene)


@given(scenes(), st.floats(0.1, 5.0))
def test_reach_heading_and_worlds_are_written_too(scene: Scene, reach: float) -> None:
    heading = np.linspace(0.0, 3.0, scene.num_robots)
    whole = Scene.from_world(
        scene.position,
        scene.velocity,
        scene.radius,
        heading=heading,
        priority=scene.priority,
        world=np.arange(scene.num_robots) % 2,
        reach=reach,
    )
    again = eval(repr(whole), {"Scene": Scene})
    assert same(again, whole)
    assert np.array_equal(again.heading, heading)


def test_what_is_the_same_for_all_robots_is_written_once() -> None:
    assert array_code(np.array([0.5, 0.5, 0.5])) == "0.5"
    assert array_code(np.array([0.5, 0.25])) == "[0.5, 0.25]"
    assert array_code(np.array([[1.0, 2.0]])) == "[[1.0, 2.0]]"


def test_defaults_are_not_written() -> None:
    scene = Scene.from_world([[0, 0], [1, 0]], np.zeros((2, 2)), 0.2)
    assert repr(scene) == (
        "Scene.from_world(position=[[0.0, 0.0], [1.0, 0.0]], velocity=[[0.0, 0.0], [0.0, 0.0]], radius=0.2)"
    )

"""Tests of the arrays of a rollout."""

from dataclasses import fields

from policies.experience import Experience


def test_shapes_are_those_of_the_docstring() -> None:
    experience = Experience.empty(num_steps=3, num_lanes=4, num_inputs=5)
    shapes = {field.name: getattr(experience, field.name).shape for field in fields(Experience)}
    assert shapes == {
        "observation": (4, 4, 5),
        "action": (3, 4, 2),
        "executed": (3, 4, 2),
        "log_probability": (3, 4),
        "reward": (3, 4),
        "acts": (3, 4),
        "ends": (3, 4),
    }


def test_at_first_nobody_has_done_anything() -> None:
    experience = Experience.empty(num_steps=2, num_lanes=2, num_inputs=1)
    assert not any(getattr(experience, field.name).any() for field in fields(Experience))


def test_arrays_are_written_to_each_by_itself() -> None:
    experience = Experience.empty(num_steps=2, num_lanes=2, num_inputs=1)
    experience.action[0] = 1.0
    experience.acts[1] = True
    assert not experience.executed.any()
    assert not experience.ends.any()


def test_numbers_are_single_and_flags_are_flags() -> None:
    experience = Experience.empty(num_steps=1, num_lanes=1, num_inputs=1)
    types = {field.name: getattr(experience, field.name).dtype.name for field in fields(Experience)}
    assert {name for name, kind in types.items() if kind == "bool"} == {"acts", "ends"}
    assert set(types.values()) == {"bool", "float32"}

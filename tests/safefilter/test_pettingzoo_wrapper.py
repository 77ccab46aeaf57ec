import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv
from pettingzoo.utils import BaseParallelWrapper

import safefilter as sf
from safefilter.errors import (
    InvalidInput,
    OutOfRange,
    SceneUnavailable,
    ShapeError,
    WrapperOrderError,
)
from safefilter.wrappers import SafeParallelEnv

with warnings.catch_warnings():
    # Where pygame is installed, its test package imports games of its own in a way that it calls deprecated.
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import parallel_api_test, parallel_seed_test

ROOT = Path(__file__).parents[2]
DT, RADIUS = 0.2, 0.1
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2))
Array = npt.NDArray[Any]
NAMES = ["anna", "bert", "carl"]


class Street(ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """Robots in a row, 0.4 m apart; who has gone 0.3 m east has arrived and parks there."""

    metadata = {"name": "street_v0"}  # noqa: RUF012  # as PettingZoo has it

    def __init__(self, *, dtype: Any = np.float32, time_limit: int = 60) -> None:
        self.possible_agents = list(NAMES)
        self.spaces = {name: Box(-0.2, 0.2, (2,), dtype) for name in NAMES}
        self.views = {name: Box(-np.inf, np.inf, (2,), np.float64) for name in NAMES}
        self.time_limit = time_limit
        self.received: list[dict[str, Array]] = []

    def observation_space(self, agent: str) -> Box:
        return self.views[agent]

    def action_space(self, agent: str) -> Box:
        return self.spaces[agent]

    def reset(
        self,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002  # as PettingZoo has it
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        rng = np.random.default_rng(seed)
        self.agents = list(self.possible_agents)
        self.position = np.stack([0.4 * np.arange(3.0), rng.uniform(-0.01, 0.01, 3)], axis=1)
        self.start = self.position.copy()
        self.velocity = np.zeros((3, 2))
        self.time = 0
        return self.observations(self.agents), {name: {"row": 0} for name in self.agents}

    def step(self, actions: dict[str, Array]) -> tuple[dict[str, Any], ...]:
        self.received.append({name: action.copy() for name, action in actions.items()})
        self.velocity[:] = 0.0
        for name, action in actions.items():
            self.velocity[NAMES.index(name)] = action
        self.position = self.position + DT * self.velocity
        self.time += 1
        acted = list(self.agents)
        arrived = {
            name: bool((self.position - self.start)[NAMES.index(name), 0] >= 0.3) for name in acted
        }
        late = {name: self.time >= self.time_limit and not arrived[name] for name in acted}
        self.agents = [name for name in acted if not (arrived[name] or late[name])]
        rewards = dict.fromkeys(acted, 1.0)
        return self.observations(acted), rewards, arrived, late, {name: {} for name in acted}

    def observations(self, names: list[str]) -> dict[str, Array]:
        return {name: self.position[NAMES.index(name)].copy() for name in names}

    def scene(self) -> sf.Scene:
        return sf.Scene.from_world(self.position, self.velocity, RADIUS)


def wrapped(street: Street | None = None, **options: Any) -> Any:
    env = SafeParallelEnv(Street() if street is None else street, FILTER, **options)
    env.reset(seed=0)
    return env


def all_east(env: Any, speed: float = 0.2) -> dict[str, Array]:
    return {name: np.array([speed, 0.0], dtype=np.float32) for name in env.agents}


def least_distance(before: Array, after: Array) -> float:
    """Least distance of two centres in straight motion."""
    i, j = np.triu_indices(len(before), 1)
    offset, change = before[j] - before[i], (after - before)[j] - (after - before)[i]
    square = (change**2).sum(axis=1)
    part = np.clip(-(offset * change).sum(axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    nearest = offset + part[:, np.newaxis] * change
    return float(np.hypot(nearest[:, 0], nearest[:, 1]).min())


# --- PettingZoo's own tests ---


def test_pettingzoo_accepts_it(capsys: pytest.CaptureFixture[str]) -> None:
    parallel_api_test(SafeParallelEnv(Street(), FILTER), num_cycles=100)
    assert "Passed" in capsys.readouterr().out


def test_a_seed_repeats_everything() -> None:
    parallel_seed_test(lambda: SafeParallelEnv(Street(), FILTER, penalty=0.1), num_cycles=50)


# --- what executes ---


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nobody_touches_anybody_and_actions_stay_in_their_space(dtype: Any) -> None:
    street = Street(dtype=dtype)
    env = wrapped(street)
    rng = np.random.default_rng(0)
    num_corrected = 0
    for episode in range(3):
        env.reset(seed=episode)
        while env.agents:
            before = street.position
            actions = {name: rng.uniform(-0.3, 0.3, 2) * [1.0, 0.1] for name in env.agents}
            *_, infos = env.step(actions)
            assert least_distance(before, street.position) >= 2 * RADIUS
            for name, action in street.received[-1].items():
                assert env.action_space(name).contains(action)
                told = infos[name]["safefilter"]
                assert told["certified"] is True
                assert told["action"].tobytes() == action.tobytes()
                num_corrected += told["case"] != sf.Case.SAFE
    assert num_corrected > 0


def test_the_bare_street_sees_collisions() -> None:
    street = Street()
    street.reset(seed=0)
    rng = np.random.default_rng(0)
    least = np.inf
    while street.agents:
        before = street.position
        street.step({name: rng.uniform(-0.2, 0.2, 2) * [1.0, 0.1] for name in street.agents})
        least = min(least, least_distance(before, street.position))
    assert least < 2 * RADIUS


def test_agents_that_are_done_stay_as_bodies_that_others_go_around() -> None:
    street = Street(time_limit=200)
    env = wrapped(street)
    while "carl" in env.agents:
        env.step({name: np.array([0.2 * (name == "carl"), 0.0]) for name in env.agents})
    street.start[1] += 99.0  # Bert never arrives, and wants to go where Carl has parked
    parked = street.position[2].copy()
    least, corrections = np.inf, []
    for _ in range(60):
        before = street.position
        *_, infos = env.step({name: np.array([0.2 * (name == "bert"), 0.0]) for name in env.agents})
        least = min(least, least_distance(before, street.position))
        corrections.append(infos["bert"]["safefilter"]["correction"])
    assert "carl" not in street.received[-1]
    assert street.position[2].tolist() == parked.tolist()
    assert 2 * RADIUS <= least < 2 * RADIUS + 0.05
    assert max(corrections) > 0.1


def test_whoever_is_done_is_flagged_for_the_others() -> None:
    seen: list[list[bool]] = []

    class Watching(sf.LinearConstraint):
        def half_spaces(self, scene: sf.Scene, action: Array, index: Array) -> sf.HalfSpaces:
            seen.append(scene.cooperative.tolist())
            return super().half_spaces(scene, action, index)

    watch = Watching([[0.0, 1.0]], [-1.0])
    street = Street()
    env = SafeParallelEnv(street, sf.SafetyFilter([sf.Separation(DT), watch], sf.Holonomic(0.2)))
    env.reset(seed=0)
    while "carl" in env.agents:
        env.step({name: np.array([0.2 * (name == "carl"), 0.0]) for name in env.agents})
    env.step(all_east(env, 0.0))
    assert seen[0] == [True, True, True]
    assert seen[-1] == [True, True, False]


def test_agents_are_the_robots_they_are_mapped_to() -> None:
    street = Street()
    order = [2, 0, 1]

    def mixed(env: Street, *_: Any) -> sf.Scene:
        place = np.argsort(order)
        return sf.Scene.from_world(env.position[place], env.velocity[place], RADIUS)

    plain, mapped = (
        wrapped(),
        wrapped(street, scene=mixed, robots=dict(zip(NAMES, order, strict=True))),
    )
    for _ in range(20):
        wish = {name: np.array([0.2, 0.0]) for name in plain.agents}
        plain.step(wish)
        mapped.step(wish)
    np.testing.assert_allclose(street.position, plain.unwrapped.position, atol=1e-6)


def test_agent_that_never_cooperates_acts_as_it_pleases() -> None:
    def scene(env: Street, *_: Any) -> sf.Scene:
        return sf.Scene.from_world(
            env.position, env.velocity, RADIUS, cooperative=[True, False, True]
        )

    street = Street()
    env = wrapped(street, scene=scene)
    street.position[1, 0] = street.position[2, 0] - 0.21
    *_, infos = env.step(all_east(env))
    assert street.received[-1]["bert"].tolist() == all_east(env)["bert"].tolist()
    assert infos["bert"]["safefilter"]["case"] == 0


# --- what it tells ---


def test_each_agent_has_its_own_penalty_and_totals() -> None:
    street = Street(time_limit=30)
    env = wrapped(street, penalty=2.0)
    totals: dict[str, Any] = {}
    steps, corrected = dict.fromkeys(NAMES, 0), dict.fromkeys(NAMES, 0)
    while env.agents:
        _, rewards, *_, infos = env.step({
            name: np.array([0.2 * (name != "carl"), 0.0]) for name in env.agents
        })
        for name, info in infos.items():
            steps[name] += 1
            corrected[name] += info["safefilter"]["correction"] > 0.0
            correction = info["safefilter"]["correction"]
            assert rewards[name] == pytest.approx(1.0 - 2.0 * correction)
            if "safefilter_episode" in info:
                totals[name] = info["safefilter_episode"]
    assert totals.keys() == set(NAMES)
    for name, numbers in totals.items():
        assert numbers["steps"] == numbers["decisions"] == steps[name]
        assert numbers["interventions"] == corrected[name]
        assert numbers["certified"] == 1.0
        assert 0.0 < numbers["min_clearance"] <= 0.21
    assert len(set(corrected.values())) > 1, "everyone was corrected alike"


def test_infos_of_the_environment_are_kept() -> None:
    class Telling(Street):
        def step(self, actions: dict[str, Array]) -> tuple[dict[str, Any], ...]:
            *results, infos = super().step(actions)
            return *results, {name: {"time": self.time} for name in infos}

    env = wrapped(Telling())
    *_, infos = env.step(all_east(env))
    assert infos["anna"].keys() == {"time", "safefilter"}


def test_when_everyone_is_done_an_empty_step_is_the_environments() -> None:
    env = wrapped(Street(time_limit=1))
    env.step(all_east(env))
    assert env.agents == []
    assert env.step({})[0] == {}


# --- what is refused ---


def test_actions_of_other_agents_than_those_that_act_are_refused() -> None:
    env = wrapped()
    with pytest.raises(InvalidInput, match=r"missing \['carl'\], and \['dora'\] do not act"):
        env.step({name: np.zeros(2) for name in ("anna", "bert", "dora")})
    with pytest.raises(ShapeError, match=r"action of 'anna': expected shape \(2,\), got \(3,\)"):
        env.step({name: np.zeros(3) for name in NAMES})


def test_scene_without_the_bodies_of_those_who_are_done_is_refused() -> None:
    def living(env: Street, *_: Any) -> sf.Scene:
        rows = [NAMES.index(name) for name in env.agents]
        return sf.Scene.from_world(env.position[rows], env.velocity[rows], RADIUS)

    env = wrapped(Street(time_limit=1), scene=living)
    with pytest.raises(OutOfRange, match="those of agents that are done stay in the world"):
        env.step(all_east(env))


def test_environment_without_scene_is_refused() -> None:
    class Blind(Street):
        scene = None  # type: ignore[assignment]  # wrong on purpose

    with pytest.raises(SceneUnavailable, match=r"Blind has no scene\(\) method"):
        SafeParallelEnv(Blind(), FILTER)


def test_robots_must_be_given_for_all_agents() -> None:
    with pytest.raises(InvalidInput, match="expected a robot for each of the agents"):
        SafeParallelEnv(Street(), FILTER, robots={"anna": 0})


def test_step_before_reset_is_refused() -> None:
    street = Street()
    street.agents = list(NAMES)
    env: Any = SafeParallelEnv(street, FILTER)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step(all_east(env))


def test_wrappers_inside_that_change_actions_are_refused() -> None:
    class Noisy(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo has no types
        changes_actions = "adds noise"

    class Wider(BaseParallelWrapper):  # type: ignore[misc]
        def action_space(self, agent: str) -> Box:  # noqa: ARG002  # as PettingZoo has it
            return Box(-1.0, 1.0, (2,))

    class Quiet(BaseParallelWrapper):  # type: ignore[misc]
        pass

    with pytest.raises(WrapperOrderError, match="Noisy inside the filter adds noise"):
        SafeParallelEnv(Quiet(Noisy(Street())), FILTER)
    with pytest.raises(WrapperOrderError, match="Wider inside the filter has another action space"):
        SafeParallelEnv(Wider(Street()), FILTER)
    with pytest.raises(WrapperOrderError, match="SafeParallelEnv inside the filter filters"):
        SafeParallelEnv(Quiet(SafeParallelEnv(Street(), FILTER)), FILTER)
    SafeParallelEnv(Quiet(Street()), FILTER)


def test_other_wrappers_are_there_without_pettingzoo_and_this_one_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['pettingzoo'] = None\n"
        "from safefilter.wrappers import *\n"
        "import safefilter.wrappers as wrappers\n"
        "print(SafeAction.__name__, SafeVectorAction.__name__, SafePolicy.__name__)\n"
        "try: wrappers.SafeParallelEnv\n"
        "except ModuleNotFoundError as error: print(error)\n"
        "try: wrappers.SafeNothing\n"
        "except AttributeError as error: print(error)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert result.stdout.splitlines() == [
        "SafeAction SafeVectorAction SafePolicy",
        "SafeParallelEnv needs PettingZoo: pip install 'safefilter[learn]'",
        "module 'safefilter.wrappers' has no attribute 'SafeNothing'",
    ]

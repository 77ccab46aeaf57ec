import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO

import envs  # noqa: F401  # registers envs:*-v0
from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from policies.checkpoint import write_weights
from policies.evaluation import evaluate_policy, make_navigation
from policies.filtering import OFF, OURS_WITH_MAP
from policies.foreign_policy import PolicyNotTrusted, PolicyPackageMissing, load_foreign
from policies.policy import Policy
from policies.policy_weights import Weights
from policies.straight_to_goal import StraightToGoal
from policies.table_scenarios import find_scenario
from safefilter.errors import InvalidInput

MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]
LAYOUT = ObservationLayout(has_memory=True)
RNG = np.random.default_rng(0)


def straight(_: Navigation) -> Policy:
    return StraightToGoal()


def nothing(_: Navigation) -> int:
    return 0


NUMBER = 7


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> str:
    """This file as a module that can be imported by name."""
    monkeypatch.setitem(sys.modules, "my_policies", sys.modules[__name__])
    return "my_policies"


def test_a_callable_is_named_by_module_and_attribute(module: str) -> None:
    policy = load_foreign(f"{module}:straight")
    assert (policy.name, policy.layout) == ("straight", None)
    row = evaluate_policy(
        policy.make, find_scenario("overtaking"), OURS_WITH_MAP, episodes=2, seed=0
    )
    assert row.collision_robot_rate == row.collision_obstacle_rate == 0.0


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (
            "straight",
            "expected package.module:callable, or a file that ends in .safetensors, .onnx, .zip",
        ),
        ("no_such_package:make", "No module named 'no_such_package'"),
        ("my_policies:absent", "has no attribute 'absent'"),
        ("my_policies:NUMBER", "expected a callable, got int"),
        ("absent.onnx", "absent.onnx: there is no such file"),
    ],
)
def test_what_is_no_policy_is_refused(module: str, source: str, message: str) -> None:
    del module
    with pytest.raises(InvalidInput, match=message):
        load_foreign(source)


def test_a_callable_that_returns_no_policy_is_refused(module: str) -> None:
    policy = load_foreign(f"{module}:nothing")
    with pytest.raises(InvalidInput, match=r"a policy with act\(world, rng\), got int"):
        policy.make(make_navigation(find_scenario("overtaking"), OFF))


def test_a_zip_is_opened_by_those_who_trust_its_author_alone(tmp_path: Path) -> None:
    path = tmp_path / "trained.zip"
    environment = gymnasium.make("envs:Scenario-v0", scenario="overtaking")
    model = PPO("MlpPolicy", environment, n_steps=8, batch_size=8, seed=0, device="cpu")
    model.save(path)
    with pytest.raises(PolicyNotTrusted, match="if you trust whoever made it, say --trust-pickle"):
        load_foreign(str(path))
    with pytest.raises(InvalidInput, match="algorithm 'Magic'"):
        load_foreign(str(path), algorithm="Magic", trusts_pickle=True)
    policy = load_foreign(str(path), trusts_pickle=True)
    assert (policy.name, policy.layout) == ("trained", ObservationLayout())
    navigation = make_navigation(find_scenario("overtaking"), OFF, layout=policy.layout)
    navigation.reset(0)
    commands = policy.make(navigation).act(navigation.world, RNG)
    expected, _ = model.predict(navigation.observe()[0, 0], deterministic=True)
    # Single precision, and another order of sums than torch's: near zero only the absolute error says anything.
    np.testing.assert_allclose(commands[0, 0], expected, rtol=1e-5, atol=1e-6)
    content = path.read_bytes()
    place = len(content) // 2
    for damaged in (b"", content[:place], content[:place] + bytes(64) + content[place + 64 :]):
        path.write_bytes(damaged)
        with pytest.raises(
            InvalidInput, match=r"trained.zip: (no zip|its part .* is not as it was)"
        ):
            load_foreign(str(path), trusts_pickle=True)


def test_an_onnx_file_needs_a_package_that_runs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "actor.onnx"
    path.write_bytes(b"")
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(PolicyPackageMissing, match=r"needs onnxruntime.*pip install onnxruntime"):
        load_foreign(str(path))


@pytest.mark.parametrize("output", ["command", "raw"])
def test_an_onnx_file_is_run_by_onnxruntime(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str
) -> None:
    """A stand-in for the package, with its interface: the file itself is its business."""
    # Knows the errors of the real one, before there is another in its place.
    importlib.import_module("policies.onnx_policy")

    class InferenceSession:
        def __init__(self, path: str, providers: list[str]) -> None:
            assert path.endswith("actor.onnx")
            assert providers == ["CPUExecutionProvider"]

        def get_inputs(self) -> list[SimpleNamespace]:
            return [SimpleNamespace(name="observation", shape=["B", LAYOUT.size])]

        def get_outputs(self) -> list[SimpleNamespace]:
            return [SimpleNamespace(name=output)]

        def run(self, names: list[str], given: dict[str, object]) -> list[object]:
            assert names == [output]
            return [np.zeros((len(np.asarray(given["observation"])), 2), dtype=np.float32)]

    path = tmp_path / "actor.onnx"
    path.write_bytes(b"")
    monkeypatch.setitem(
        sys.modules,
        "onnxruntime",
        SimpleNamespace(InferenceSession=InferenceSession),
    )
    policy = load_foreign(str(path))
    assert policy.layout == LAYOUT
    navigation = make_navigation(find_scenario("overtaking"), OFF, layout=policy.layout)
    navigation.reset(0)
    speed = policy.make(navigation).act(navigation.world, RNG)[0, 0, 0]
    assert speed == pytest.approx(0.1 if output == "raw" else 0.0)


def test_weights_drive_by_their_path(tmp_path: Path, constant_weights: MakeWeights) -> None:
    write_weights(tmp_path / "mine.safetensors", constant_weights((0.4, -0.2), LAYOUT))
    policy = load_foreign(str(tmp_path / "mine.safetensors"))
    assert (policy.name, policy.layout) == ("constant", LAYOUT)
    navigation = make_navigation(find_scenario("overtaking"), OFF, layout=LAYOUT)
    navigation.reset(0)
    commands = policy.make(navigation).act(navigation.world, RNG)
    np.testing.assert_allclose(commands[0, 0], [0.14, -0.5], rtol=1e-5)

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

import safefilter as sf
from safefilter.differentiable import Projected, Projection, as_tensors
from safefilter.errors import EmptyHardSet, InvalidInput, NotFinite, OutOfRange, ShapeError

Ask = Callable[..., Any]
SEEDS = st.integers(0, 10**6)


def solve(question: Any) -> Projected:
    return Projection().solve(question.action, question.normals, question.offsets, **question.masks)


def point_of(question: Any) -> Tensor:
    return solve(question).point


def ring(num_robots: int, radius: float, seed: int) -> tuple[sf.Scene, np.ndarray[Any, Any]]:
    """Robots on a circle that want to cross it, and have begun to."""
    rng = np.random.default_rng(seed)
    angle = 2.0 * np.pi * np.arange(num_robots) / num_robots + rng.normal(0.0, 0.05, num_robots)
    position = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    scene = sf.Scene.from_world(position, -0.15 * position / radius, 0.105)
    return scene, -0.2 * position / radius


@pytest.mark.parametrize("radius", [0.25, 0.4, 0.6, 1.5])
@pytest.mark.parametrize("seed", range(5))
def test_it_answers_as_the_filter_does_to_the_bit(radius: float, seed: int) -> None:
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
    scene, wanted = ring(7, radius, seed)
    decision = safety.decide(scene, wanted)
    rows = as_tensors(safety.half_spaces(scene, wanted))
    safe = Projection().solve(torch.from_numpy(wanted), **rows)
    # A wish on the circle is outside of the polygon in it; the filter lets it through, because it can be executed.
    changed = decision.case != sf.Case.SAFE
    assert safe.point.numpy()[changed].tolist() == decision.velocity[changed].tolist()
    assert safe.case.numpy()[changed].tolist() == decision.case[changed].tolist()
    assert np.abs(safe.point.numpy() - decision.velocity).max() < 0.2 * (1.0 - np.cos(np.pi / 64))


def test_the_crossings_are_of_both_kinds() -> None:
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
    cases = [safety.decide(*ring(7, radius, 0)).case[0] for radius in (0.25, 0.6)]
    assert cases == [sf.Case.LEAST_VIOLATION, sf.Case.PROJECTED]


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64, torch.float16])
def test_a_permitted_action_comes_back_bit_for_bit(dtype: torch.dtype) -> None:
    action = torch.tensor([[0.1, 1 / 3], [-0.7, 0.2]], dtype=dtype)
    normals = torch.tensor([[-1.0, 0.0]], dtype=dtype)
    safe = Projection()(action, normals, torch.tensor([-0.5], dtype=dtype))
    assert safe.dtype == dtype
    assert safe.equal(action)


def test_gradients_have_the_dtype_of_what_they_are_of() -> None:
    action = torch.tensor([[1.0, 0.2]], requires_grad=True)
    normals = torch.tensor([[[-2.0, 0.0]]], dtype=torch.float64, requires_grad=True)
    offsets = torch.tensor([[-1.0]], requires_grad=True)
    Projection()(action, normals, offsets).sum().backward()
    assert action.grad is not None
    assert action.grad.tolist() == [[0.0, 1.0]]
    assert action.grad.dtype == torch.float32
    assert normals.grad is not None
    assert normals.grad.dtype == torch.float64
    assert offsets.grad is not None
    assert offsets.grad.tolist() == [[-0.5]]


@pytest.mark.parametrize("size", [1, 2, 3, 5])
@pytest.mark.parametrize("case", list(sf.Case))
def test_gradcheck_finds_the_derivative_in_every_case(ask: Ask, case: sf.Case, size: int) -> None:
    question = ask(size, 200, size, 5 + 2 * size)
    answered = solve(question)
    some = torch.nonzero(answered.case == case)[:4, 0]
    assert len(some) == 4
    question = question.part(some).with_gradients()
    inputs = (question.action, question.normals, question.offsets)
    projection = Projection()

    def outputs(*tensors: Tensor) -> tuple[Tensor, ...]:
        return projection.solve(*tensors, **question.masks)[:2]

    assert torch.autograd.gradcheck(outputs, inputs, fast_mode=size > 2)


@given(seed=SEEDS, size=st.sampled_from([2, 3, 4]))
@settings(max_examples=40)
def test_the_derivative_foresees_small_changes(ask: Ask, seed: int, size: int) -> None:
    # Not a single step of torch's: central differences along a random direction, where the active rows stay the same.
    question = ask(seed, 20, size, 8).with_gradients()
    answered = solve(question)
    rng = torch.Generator().manual_seed(seed)
    leaves = (question.action, question.normals, question.offsets)
    directions = [torch.randn(leaf.shape, generator=rng, dtype=leaf.dtype) for leaf in leaves]
    out = torch.randn(answered.point.shape, generator=rng, dtype=torch.float64)
    ((answered.point * out).sum(1) + answered.least_violation).sum().backward()  # type: ignore[no-untyped-call]  # torch's own
    slope = sum(
        (leaf.grad * d).flatten(1).sum(1) for leaf, d in zip(leaves, directions, strict=True)
    )
    step, values, same = 1e-6, [], torch.ones(20, dtype=torch.bool)
    for sign in (1.0, -1.0):
        moved = [
            leaf.detach() + sign * step * d for leaf, d in zip(leaves, directions, strict=True)
        ]
        there = Projection().solve(moved[0], moved[1], moved[2], **question.masks)
        values.append((there.point * out).sum(1) + there.least_violation)
        same &= (there.active.sort(1).values == answered.active.sort(1).values).all(1)
        same &= (there.proof.sort(1).values == answered.proof.sort(1).values).all(1)
    change = (values[0] - values[1]) / (2.0 * step)
    scale = 1.0 + slope.abs() + answered.point.detach().norm(dim=1) ** 2
    # Rows at a small angle bend the answer within the step; the others are exact to what differences can tell.
    assert ((change - slope).abs() / scale)[same].quantile(0.75) < 1e-4
    assert same.sum() >= 10


@given(seed=SEEDS, size=st.sampled_from([2, 3]))
@settings(max_examples=40)
def test_projecting_twice_is_projecting_once(ask: Ask, seed: int, size: int) -> None:
    question = ask(seed, 20, size)
    first = solve(question)
    again = Projection(tolerance=1e-7).solve(
        first.point, question.normals, question.offsets, **question.masks
    )
    is_permitted = first.case != sf.Case.LEAST_VIOLATION
    assert (again.case[is_permitted] == sf.Case.SAFE).all()
    scale = 1.0 + first.point.norm(dim=1)
    assert ((again.point - first.point).norm(dim=1) <= 1e-6 * scale)[is_permitted].all()


@given(seed=SEEDS, size=st.sampled_from([2, 3]))
@settings(max_examples=40)
def test_hard_rows_hold_and_soft_ones_miss_by_t_at_most(ask: Ask, seed: int, size: int) -> None:
    question = ask(seed, 40, size)
    answered = solve(question)
    along = torch.einsum("bmn,bn->bm", question.normals, answered.point)
    violation = torch.where(question.present, question.offsets - along, -torch.inf)
    allowed = torch.where(question.hard, 0.0, answered.least_violation[:, None])
    scale = 1.0 + question.action.abs().sum(1, keepdim=True)
    assert (violation <= allowed + 4e-9 * scale).all()
    assert ((answered.least_violation > 1e-9) == (answered.case == sf.Case.LEAST_VIOLATION)).all()


@given(seed=SEEDS)
@settings(max_examples=40)
def test_turning_the_world_turns_the_answer_and_its_gradient(ask: Ask, seed: int) -> None:
    question = ask(seed, 20, 3)
    turn = torch.linalg.qr(
        torch.randn(3, 3, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    ).Q
    first, second = question.with_gradients(), question.with_gradients()
    weights = torch.tensor([1.0, -2.0, 0.5], dtype=torch.float64)
    (point_of(first) @ weights).sum().backward()  # type: ignore[no-untyped-call]  # torch's own
    turned = Projection()(
        second.action @ turn.T, second.normals @ turn.T, second.offsets, **question.masks
    )
    (turned @ (turn @ weights)).sum().backward()
    same = solve(question)
    sliver = (same.multipliers.amax(1) > 1e2) | (same.point.norm(dim=1) > 1e2)
    torch.testing.assert_close((turned @ turn)[~sliver], same.point[~sliver], atol=1e-7, rtol=0.0)
    torch.testing.assert_close(
        second.action.grad[~sliver], first.action.grad[~sliver], atol=1e-6, rtol=0.0
    )


def test_rows_that_all_decisions_share_gather_gradients_of_all() -> None:
    action = torch.tensor([[1.0, 0.0], [2.0, 0.3], [0.1, 0.0]])
    offsets = torch.tensor([-0.5], requires_grad=True)
    safe = Projection()(action, torch.tensor([[-1.0, 0.0]]), offsets, hard=torch.tensor([True]))
    assert safe[:, 0].tolist() == pytest.approx([0.5, 0.5, 0.1])
    safe.sum().backward()
    assert offsets.grad is not None
    assert offsets.grad.tolist() == [-2.0]


def test_nothing_is_asked_and_nothing_answered() -> None:
    projection = Projection()
    assert projection(torch.empty(0, 2), torch.empty(0, 4, 2), torch.empty(0, 4)).shape == (0, 2)
    action = torch.ones(3, 2, requires_grad=True)
    safe = projection(action, torch.empty(0, 2), torch.empty(0))
    safe.sum().backward()
    assert safe.equal(action)
    assert action.grad is not None
    assert action.grad.equal(torch.ones(3, 2))


def test_there_is_no_second_derivative(ask: Ask) -> None:
    question = ask(0, 5).with_gradients()
    [slope] = torch.autograd.grad(point_of(question).sum(), question.normals, create_graph=True)
    with pytest.raises(RuntimeError, match="project_backward"):
        slope.sum().backward()


def test_torch_compile_takes_it_without_a_break(ask: Ask) -> None:
    question = ask(0, 12).with_gradients()
    projection = Projection()

    def loss(action: Tensor, normals: Tensor, offsets: Tensor) -> Tensor:
        safe: Tensor = projection(torch.tanh(action), normals, offsets, **question.masks)
        return safe.square().sum()

    compiled: Any = torch.compile(loss, backend="aot_eager", fullgraph=True)
    leaves = (question.action, question.normals, question.offsets)
    expected, found = loss(*leaves), compiled(*leaves)
    assert found.item() == expected.item()
    for one, other in zip(
        torch.autograd.grad(expected, leaves), torch.autograd.grad(found, leaves), strict=True
    ):
        torch.testing.assert_close(one, other)


def test_no_tensor_is_made_where_nobody_named_a_device(ask: Ask) -> None:
    question = ask(0, 30).with_gradients()
    with torch.device("meta"):
        point = Projection()(question.action, question.normals, question.offsets)
        point.sum().backward()
    assert point.device.type == question.normals.grad.device.type == "cpu"


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_on_cuda_it_answers_as_on_the_cpu(ask: Ask) -> None:
    here, there = ask(0, 200).with_gradients(), ask(0, 200)
    leaves = [
        getattr(there, name).cuda().requires_grad_() for name in ("action", "normals", "offsets")
    ]
    masks = {name: mask.cuda() for name, mask in there.masks.items()}
    point = Projection()(*leaves, **masks)
    point.square().sum().backward()
    own = point_of(here)
    own.square().sum().backward()  # type: ignore[no-untyped-call]  # torch's own
    torch.testing.assert_close(point.cpu(), own, atol=1e-8, rtol=0.0)
    torch.testing.assert_close(leaves[0].grad.cpu(), here.action.grad, atol=1e-7, rtol=0.0)


# Of cvxpylayers, with numpy 2.
@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_cvxpylayers_finds_the_same_derivative(ask: Ask) -> None:
    cp = pytest.importorskip("cvxpy")
    layers = pytest.importorskip("cvxpylayers.torch")
    question = ask(1, 60, 2, 6)
    answered = solve(question)
    held = (answered.active >= 0).sum(1)
    # One row held, or two that are not all but parallel: conic solvers are good to some 1e-6.
    clear = (answered.multipliers.amax(1) < 10.0) & (held > 0) & (answered.case == 2)
    some = torch.nonzero(clear & question.present.all(1))[:8, 0]
    question = question.part(some).with_gradients()
    variable, wanted = cp.Variable(2), cp.Parameter(2)
    normals, offsets = cp.Parameter((6, 2)), cp.Parameter(6)
    problem = cp.Problem(
        cp.Minimize(0.5 * cp.sum_squares(variable - wanted)), [normals @ variable >= offsets]
    )
    layer = layers.CvxpyLayer(problem, parameters=[wanted, normals, offsets], variables=[variable])
    leaves = (question.action, question.normals, question.offsets)
    weights = torch.tensor([1.0, -0.7], dtype=torch.float64)
    [theirs] = layer(
        *leaves,
        solver_args={"solve_method": "Clarabel", "tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12},
    )
    ours = point_of(question)
    torch.testing.assert_close(ours, theirs, atol=1e-6, rtol=0.0)
    for one, other in zip(
        torch.autograd.grad((ours @ weights).sum(), leaves),
        torch.autograd.grad((theirs @ weights).sum(), leaves),
        strict=True,
    ):
        torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-4)
    assert len(some) >= 4


def test_what_cannot_be_used_is_refused() -> None:
    projection = Projection()
    action, normals, offsets = torch.zeros(2, 3), torch.eye(3).expand(2, 3, 3), torch.ones(2, 3)
    with pytest.raises(ShapeError, match=r"action: expected shape \(B, n\), got \(3,\)"):
        projection(action[0], normals, offsets)
    with pytest.raises(ShapeError, match=r"normals: expected shape \(2, 3, 3\) or \(3, 3\)"):
        projection(action, normals[:, :, :2], offsets)
    with pytest.raises(ShapeError, match=r"normals: expected shape \(B, M, n\) or \(M, n\)"):
        projection(action, offsets[0], offsets)
    with pytest.raises(ShapeError, match="offsets: expected shape"):
        projection(action, normals, offsets[:, :2])
    with pytest.raises(ShapeError, match="hard: expected shape"):
        projection(action, normals, offsets, hard=torch.ones(4, 3, dtype=torch.bool))
    with pytest.raises(InvalidInput, match="present: expected a tensor of bool"):
        projection(action, normals, offsets, present=torch.ones(2, 3))
    with pytest.raises(InvalidInput, match="action: expected a tensor, got ndarray"):
        projection(action.numpy(), normals, offsets)
    with pytest.raises(InvalidInput, match="offsets: expected a tensor of floats"):
        projection(action, normals, offsets.long())
    with pytest.raises(InvalidInput, match="normals: expected it on cpu like the action, got meta"):
        projection(action, normals.to("meta"), offsets)
    with pytest.raises(NotFinite, match="action of decision 1"):
        projection(torch.tensor([[0.0] * 3, [float("nan")] * 3]), normals, offsets)
    clash = torch.tensor([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])
    with pytest.raises(EmptyHardSet, match="decision 0"):
        projection(action[:1], clash, offsets[:1, :2], hard=torch.ones(2, dtype=torch.bool))
    with pytest.raises(OutOfRange, match="tolerance"):
        Projection(tolerance=0.0)

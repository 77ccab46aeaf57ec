"""Other differentiable solvers of quadratic programs, each as a function of action, normals and offsets.

qpth is asked if it is there: it says that it needs numpy below 2, so nothing that installs it beside this package will;
``pip install --no-deps qpth`` does, and it works.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any

import cvxpy
import torch
from cvxpy.atoms.sum_squares import sum_squares
from cvxpylayers.torch.cvxpylayer import CvxpyLayer
from proxsuite.torch.qplayer import QPFunction
from torch import Tensor

Forward = Callable[[Tensor, Tensor, Tensor], Tensor]


def peers(size: int, num_rows: int) -> dict[str, Forward]:
    """Peers by name, for rows of one size."""
    found = {"cvxpylayers": cvxpylayers(size, num_rows), "QPLayer": qp_layer(size)}
    if importlib.util.find_spec("qpth"):
        found["qpth"] = qpth(size)
    return found


def cvxpylayers(size: int, num_rows: int) -> Forward:
    """CvxpyLayer (Agrawal et al. 2019): a conic solver, and the derivative of its optimality conditions."""
    point, wanted = cvxpy.Variable(size), cvxpy.Parameter(size)
    normals, offsets = cvxpy.Parameter((num_rows, size)), cvxpy.Parameter(num_rows)
    objective = cvxpy.Minimize(0.5 * sum_squares(point - wanted))
    problem = cvxpy.Problem(objective, [normals @ point >= offsets])
    layer: Any = CvxpyLayer(problem, parameters=[wanted, normals, offsets], variables=[point])
    settings = {"solve_method": "Clarabel", "n_jobs_forward": 1, "n_jobs_backward": 1}

    def forward(*question: Tensor) -> Tensor:
        [answer] = layer(*question, solver_args=settings)
        found: Tensor = answer
        return found

    return forward


def qp_layer(size: int) -> Forward:
    """QPLayer (Bambade et al. 2024): ProxQP with its derivative, one program after the other in C++."""
    layer: Any = QPFunction()
    identity, no_rows, none = (
        torch.eye(size).double(),
        torch.empty(0, size).double(),
        torch.empty(0).double(),
    )

    def forward(action: Tensor, normals: Tensor, offsets: Tensor) -> Tensor:
        above = torch.full_like(offsets, 1e20)
        found: Tensor = layer(identity, -action, no_rows, none, normals, offsets, above)[0]
        return found

    return forward


def qpth(size: int) -> Forward:
    """OptNet's solver (Amos and Kolter 2017): an interior point method in torch, the whole batch in step."""
    solver: Any = importlib.import_module("qpth.qp")
    layer = solver.QPFunction(verbose=-1, check_Q_spd=False)
    identity, none = torch.eye(size).double(), torch.empty(0).double()

    def forward(action: Tensor, normals: Tensor, offsets: Tensor) -> Tensor:
        found: Tensor = layer(identity, -action, -normals, -offsets, none, none)
        return found

    return forward

"""A safety filter for learned policies: any policy, any solver, certified actions.

See `SafetyFilter`. The mathematics is that of Qin et al., "SRL-ORCA: A Socially Aware Multi-Agent Mapless Navigation
Algorithm in Complex Dynamic Scenes", with hard one-step separation added.
"""

from __future__ import annotations

from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.registry import available_backends, make_backend, register_backend
from safefilter.certificate import Certificate, certify
from safefilter.comparison.runner import compare_backends
from safefilter.constraints.affine_barrier import AffineBarrier
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.linear_constraint import LinearConstraint
from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.constraints.static_obstacles import StaticObstacles
from safefilter.decision import Case, Decision, Fault
from safefilter.errors import SafeFilterError
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import Box
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.kinematics.holonomic import Holonomic
from safefilter.lidar import Lidar
from safefilter.programs.convex_program import ConvexProgram
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.solve import solve
from safefilter.uncertainty import Uncertainty
from safefilter.worlds import Worlds

__version__ = "0.1.0"

__all__ = [
    "AffineBarrier",
    "Backend",
    "Box",
    "Capabilities",
    "Case",
    "Certificate",
    "Constraint",
    "ConvexProgram",
    "Decision",
    "DifferentialDrive",
    "Fault",
    "HalfSpaces",
    "Holonomic",
    "Lidar",
    "LinearConstraint",
    "PriorityORCA",
    "SafeFilterError",
    "SafetyFilter",
    "Scene",
    "Separation",
    "Solution",
    "StaticObstacles",
    "Status",
    "Uncertainty",
    "Worlds",
    "available_backends",
    "certify",
    "compare_backends",
    "make_backend",
    "register_backend",
    "solve",
]

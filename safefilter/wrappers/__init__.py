"""Wrappers that put a `SafetyFilter` between a policy and what executes its actions.

`SafeParallelEnv` is loaded on request, because it needs PettingZoo; so it is no part of ``import *``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from safefilter.wrappers.gymnasium_wrapper import SafeAction
from safefilter.wrappers.policy_wrapper import SafePolicy
from safefilter.wrappers.vector_wrapper import SafeVectorAction

if TYPE_CHECKING:
    from safefilter.wrappers.pettingzoo_wrapper import SafeParallelEnv as SafeParallelEnv

__all__ = ["SafeAction", "SafePolicy", "SafeVectorAction"]


def __getattr__(name: str) -> object:
    if name == "SafeParallelEnv":
        from safefilter.wrappers.pettingzoo_wrapper import SafeParallelEnv  # noqa: PLC0415

        return SafeParallelEnv
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

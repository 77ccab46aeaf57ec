"""Wrappers that put a `SafetyFilter` between a policy and what executes its actions."""

from __future__ import annotations

from safefilter.wrappers.gymnasium_wrapper import SafeAction

__all__ = ["SafeAction"]

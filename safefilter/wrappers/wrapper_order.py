"""Wrapper order: nothing between the filter and the environment may touch an action.

A certificate is about one action in one scene. Clipped, rescaled, repeated or replaced afterwards, it says nothing of
what executes.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from safefilter.errors import WrapperOrderError

# What gymnasium's own wrappers do that are no `ActionWrapper`s and keep the action space. Looked up by name: not every
# release has all of them.
CHANGES = {
    "AtariPreprocessing": "repeats actions",
    "Autoreset": "drops the action of the step in which it resets",
    "MaxAndSkipObservation": "repeats actions",
    "RepeatAction": "repeats actions",
}


def require_innermost(env: gymnasium.Env[Any, Any]) -> None:
    """Check that the wrappers of ``env`` hand every action through, once and as it is.

    Wrappers of observations, rewards, time limits, videos and the like do. A wrapper of one's own that overrides
    ``step``, keeps the action space and still changes actions cannot be told from those, unless it says so: by an
    attribute ``changes_actions``, a text such as "adds noise".

    Args:
        env: What a filter is about to be put around.

    Raises:
        WrapperOrderError: If one does not; names it and says what it does.
    """
    layer = env
    while isinstance(layer, gymnasium.Wrapper):
        change = _change(layer)
        if change:
            name = type(layer).__name__
            raise WrapperOrderError(
                f"{name} inside the filter {change}, so what executes would not be what was certified: put the filter "
                f"around the environment first, and {name} around the filter"
            )
        layer = layer.env


def _change(layer: gymnasium.Wrapper[Any, Any, Any, Any]) -> str:
    """What a wrapper does to actions, or nothing."""
    if isinstance(layer, gymnasium.ActionWrapper):
        return "transforms actions"
    said = getattr(layer, "changes_actions", "")
    if said:
        return str(said)
    for name, change in CHANGES.items():
        known = getattr(gymnasium.wrappers, name, None)
        if known is not None and isinstance(layer, known):
            return change
    if layer.action_space != layer.env.action_space:
        return f"has another action space ({layer.action_space} for {layer.env.action_space})"
    return ""

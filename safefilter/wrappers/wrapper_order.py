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
LAYERS = (gymnasium.Wrapper, gymnasium.vector.VectorWrapper)
TRANSFORMS = (gymnasium.ActionWrapper, gymnasium.vector.VectorActionWrapper)


def require_innermost(env: Any) -> None:
    """Check that the wrappers of ``env``, an environment or a vector one, hand every action through, once and as it is.

    Wrappers of observations, rewards, time limits, videos and the like do. A wrapper of one's own that overrides
    ``step``, keeps the action space and still changes actions cannot be told from those, unless it says so: by an
    attribute ``changes_actions``, a text such as "adds noise".

    Args:
        env: What a filter is about to be put around.

    Raises:
        WrapperOrderError: If one does not; names it and says what it does.
    """
    layer = env
    while isinstance(layer, LAYERS):
        change = _change(layer)
        if change:
            refuse(layer, change)
        layer = layer.env


def require_innermost_in_lanes(env: gymnasium.vector.VectorEnv[Any, Any, Any]) -> None:
    """Check the wrappers of a vector environment, and those of its environments where they are in this process.

    Args:
        env: What a filter is about to be put around.

    Raises:
        WrapperOrderError: If one does not hand actions through.
    """
    require_innermost(env)
    for lane in getattr(env.unwrapped, "envs", ()):
        require_innermost(lane)


def refuse(layer: object, change: str) -> None:
    """Say that a wrapper may not be inside.

    Raises:
        WrapperOrderError: Always.
    """
    name = type(layer).__name__
    raise WrapperOrderError(
        f"{name} inside the filter {change}, so what executes would not be what was certified: put the filter "
        f"around the environment first, and {name} around the filter"
    )


def _change(layer: Any) -> str:
    """What a wrapper does to actions, or nothing."""
    if isinstance(layer, TRANSFORMS):
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

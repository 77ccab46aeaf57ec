"""Records as the code that makes them, so that a failed check can be pasted and run.

Floats are written so that they come back bit for bit.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from safefilter.scene import Scene


def array_code(array: npt.NDArray[np.generic]) -> str:
    """Write an array as nested lists; one number if all entries of a vector are equal."""
    values = array.tolist()
    if array.ndim == 1 and len(values) > 0 and all(value == values[0] for value in values):
        return repr(values[0])
    return repr(values)


def scene_code(scene: Scene) -> str:
    """Write the call of `Scene.from_world` that makes a scene."""
    parts = [
        f"position={array_code(scene.position)}",
        f"velocity={array_code(scene.velocity)}",
        f"radius={array_code(scene.radius)}",
    ]
    if scene.heading is not None:
        parts.append(f"heading={scene.heading.tolist()!r}")
    if (scene.priority != 1.0).any():
        parts.append(f"priority={array_code(scene.priority)}")
    if not scene.cooperative.all():
        parts.append(f"cooperative={array_code(scene.cooperative)}")
    if scene.wanted is not None:
        parts.append(f"wanted={array_code(scene.wanted)}")
    if (scene.world != 0).any():
        parts.append(f"world={array_code(scene.world)}")
    if scene.num_shared_walls > 0:
        walls = scene.walls[: scene.num_shared_walls, :4].reshape(-1, 2, 2)
        parts.append(f"walls={array_code(walls)}")
    if np.isfinite(scene.reach):
        parts.append(f"reach={scene.reach!r}")
    return f"Scene.from_world({', '.join(parts)})"


def decision_code(
    scene: Scene, action: npt.NDArray[np.generic], index: npt.NDArray[np.integer], check: str
) -> str:
    """Write the code that decides again and checks again, for the end of a message."""
    return (
        "to repeat it:\n"
        f"  scene = {scene_code(scene)}\n"
        f"  action = np.array({array_code(action)}, dtype=np.{action.dtype})\n"
        f"  decision = safety_filter.decide(scene, action, {index.tolist()})\n"
        f"  {check}(safety_filter, scene, action, decision)"
    )

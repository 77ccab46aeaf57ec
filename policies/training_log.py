"""TrainingLog: the learning curve, as TensorBoard events and as plain figures for checkpoints.

TensorBoard is optional: without its package the curve is kept all the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

from torch.utils.tensorboard import SummaryWriter


class TrainingLog:
    """Writes figures while training goes on.

    Attributes:
        points: All figures so far: ``num_steps``, and others by name.
    """

    def __init__(self, folder: Path, points: list[dict[str, float]], *, num_steps: int) -> None:
        """Go on where a curve ended.

        Args:
            folder: Where TensorBoard's events go.
            points: The curve so far.
            num_steps: Steps so far: later events of a killed run are hidden by TensorBoard.
        """
        self.points = points
        self._writer = SummaryWriter(str(folder), purge_step=num_steps if points else None)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self._writer.close()

    def add(self, num_steps: int, figures: Mapping[str, float]) -> None:
        """Add a point.

        Args:
            num_steps: Steps of robots.
            figures: Values by name; a slash makes groups.
        """
        self.points.append({"num_steps": float(num_steps), **figures})
        for name, value in figures.items():
            self._writer.add_scalar(name, value, num_steps)

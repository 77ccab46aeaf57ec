"""The filter as a layer of a network: `Projection`, differentiable by torch (extra `learn`)."""

from __future__ import annotations

from safefilter.differentiable.projection import Projected, Projection, as_tensors

__all__ = ["Projected", "Projection", "as_tensors"]

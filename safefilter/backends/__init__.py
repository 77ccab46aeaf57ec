"""Solvers of `ConvexProgram`: one file each, found by name in `safefilter.backends.registry`."""

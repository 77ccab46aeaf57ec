"""Benchmarks: what the filter costs, as ratios within one run. Run all by ``python -m benchmarks``."""

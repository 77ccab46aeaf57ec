"""Machine-checked lemmas about the formulas that `safefilter` ships; run them with ``python -m proofs``."""

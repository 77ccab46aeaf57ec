"""Which solver, and at what setting: problem sets, an exact oracle, measures, and a report."""

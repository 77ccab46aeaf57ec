"""A batch of decisions in one compiled kernel."""

"""The two programs of the paper, built from rows."""

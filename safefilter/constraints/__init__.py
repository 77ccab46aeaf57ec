"""What makes rows: one file a concept."""

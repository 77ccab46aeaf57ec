"""The stress campaign: numbered cases of every kind, driven by several processes, resumable at any moment."""

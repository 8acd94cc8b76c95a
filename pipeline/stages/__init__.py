"""The stages of a run from scene to curves: cache keys, models, solution, files."""

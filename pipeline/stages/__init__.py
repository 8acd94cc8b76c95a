"""The stages of a run: names, cache keys, models, solution of the curves, files of the curves."""

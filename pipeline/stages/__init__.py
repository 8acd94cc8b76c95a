"""The stages of a run: names, cache keys, requests; `model` makes models, `curve` solves and stores curves."""

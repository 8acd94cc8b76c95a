"""The scene file: schema, reading, presets, checks and plausibility warnings."""

"""The scene file: schema, reading, checks and what is said of unusual values."""

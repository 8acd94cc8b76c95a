"""Worker processes, signals, progress, and reading files in isolation."""

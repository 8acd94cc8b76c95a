"""Processes, signals and progress."""

"""Figures of a sweep: response curves, peaks against the swept parameter, hysteresis loops, natural frequencies."""

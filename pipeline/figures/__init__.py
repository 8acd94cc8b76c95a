"""Figures of a sweep: response curves, peaks against the swept parameter, contact hysteresis loops."""

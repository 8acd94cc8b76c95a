"""Stability of a periodic solution: Hill's method on the condensed problem, with the memory of the sliders."""

"""The harmonic balance equations at one frequency: residual, Newton's method, initial solution."""

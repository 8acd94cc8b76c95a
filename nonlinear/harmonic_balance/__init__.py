"""The harmonic balance equations at one frequency: residual, Newton's method, initial solution.

References
----------
M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer, 2019.
"""

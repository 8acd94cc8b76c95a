"""Residual tractions of nodes that stick all the time: they are not unique, and so is not the response.

`traction_levels` (contact forces for given residual tractions), `amplitude_sensitivity` (exact gradient by the
adjoint equation), `extreme_amplitude` (lowest and highest amplitude), `residual_bounds` (bounds of a peak).

References
----------
E. Ferhatoglu, S. Zucca, Determination of periodic response limits among multiple solutions for mechanical systems
with wedge dampers, Journal of Sound and Vibration 494 (2021) 115900.
"""

"""Residual tractions of nodes that stick all the time: they are not unique, and so is not the response.

`extreme_amplitude` (contact forces for given residual tractions, the exact gradient of the amplitude, the lowest and
the highest one), `residual_bounds` (bounds of a peak).

References
----------
E. Ferhatoglu, S. Zucca, Determination of periodic response limits among multiple solutions for mechanical systems
with wedge dampers, Journal of Sound and Vibration 494 (2021) 115900.
"""

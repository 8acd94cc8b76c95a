"""Craig-Bampton reduction: boundary dofs, fixed-interface modes, residual modes, number of modes."""

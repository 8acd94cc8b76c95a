"""Craig-Bampton reduction: boundary dofs, fixed-interface modes, residual modes, choice of the modes."""

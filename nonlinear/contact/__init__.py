"""Contact elements: periodic relative displacement in, contact forces and their Jacobian out."""

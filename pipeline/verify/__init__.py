"""What a reduced model gets wrong: modes left out and mesh, measured, and which of the two to refine."""

"""Modal truncation error and mesh error of reduced models, and which of the two to refine."""

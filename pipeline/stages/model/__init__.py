"""Models: mesh, full model, reduced model, its frequencies and its truncation error."""

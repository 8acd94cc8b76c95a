"""Offscreen pictures of mode shapes, drawn in a process of their own: a missing GL library cannot end a run."""

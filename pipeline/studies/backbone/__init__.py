"""The study `backbone`: nonlinear modes of a scene, and their resonances beside the peaks of its curves."""

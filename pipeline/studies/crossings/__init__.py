"""The study `crossings`: every resonance of the engine orders over a range of speeds."""

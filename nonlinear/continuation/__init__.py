"""Pseudo-arc-length continuation of the harmonic balance in the frequency."""

"""Nonlinear modes: frequency and damping of one mode over its amplitude, and the resonances that follow from them."""

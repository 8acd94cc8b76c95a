"""Truncation error, and the number of harmonics that a tolerance asks for."""

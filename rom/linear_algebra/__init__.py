"""Sparse factorisation, eigenvalue solver and orthonormalisation."""

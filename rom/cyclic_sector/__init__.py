"""Sectors whose cut faces are joined to the neighbours: bladed disks under cyclic symmetry."""

"""The finite element model of a sector: assembly, material, rotation."""

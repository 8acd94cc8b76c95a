"""Results for other programs: MATLAB files, universal files, mode shapes on the mesh."""

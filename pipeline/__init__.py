"""Scene files, stages and their reuse, sweeps, figures, renders and the command line; no equations."""

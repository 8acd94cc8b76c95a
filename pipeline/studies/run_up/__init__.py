"""The study `run_up`: the ring while the excitation frequency rises or falls."""

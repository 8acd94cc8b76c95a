"""Tasks of a sweep, run in this process, in worker processes or on a cluster."""

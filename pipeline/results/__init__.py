"""The results of a run: output files, tables, and reading them back."""

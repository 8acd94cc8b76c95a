"""The results of a run: files, tables, and what Python reads from them."""

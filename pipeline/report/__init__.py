"""One self-contained page about a run: figures, tables, error budget and an interactive view of the blade."""

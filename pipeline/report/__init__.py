"""One self-contained page about a run: what the figures show, what the numbers are worth, the blade to turn round."""

"""The stage `stress`: which curves, their files and pictures in the output folder, and the entries of the summary."""

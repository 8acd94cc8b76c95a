"""Run time against error: one module for each study, and what they share."""

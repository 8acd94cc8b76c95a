"""Run times of one state of the program beside those of another: what is measured, and the table of both."""

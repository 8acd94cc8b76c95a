"""The command `shroud optimise`: ranges from the command line, the study `optimum`, its file and figure."""

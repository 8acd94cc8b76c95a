"""Branches of a response curve: continued over a range, with their special points; detached branches."""

"""Branches of a response curve: over the frequency range, with their special points; isolated branches."""

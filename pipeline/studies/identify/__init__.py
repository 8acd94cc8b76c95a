"""The study `identify`: parameters of contact, load and damping from measured motions."""

"""`shroud check`: whether a ring keeps one motion of a response curve, and where it goes if not."""

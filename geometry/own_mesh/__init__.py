"""A mesh of another program taken for a sector: units, axes, sets, faces paired under the pitch, contact points."""

"""Stress on the mesh: recovery at the nodes, motion with static correction, fatigue margin, singular places."""

"""Wear of the contact faces: a slow state beside the vibration.

worn_motion    the motion of an operating point, followed while the faces wear
wear_history   the slow time: interference, work and cycles, with events
"""

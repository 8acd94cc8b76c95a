"""Conversion of units."""

from __future__ import annotations

import math


def angular_speed(speed_rpm: float) -> float:
    """Angular speed in rad/s of a rotational speed in rev/min."""
    return speed_rpm * math.pi / 30.0

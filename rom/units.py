"""Conversion of units."""

from __future__ import annotations

import math


def angular_speed(speed_rpm: float) -> float:
    """Angular speed in rad/s of a rotational speed in rev/min.

    `speed_rpm`: rotational speed, rev/min. Returns angular speed, rad/s.
    """
    return speed_rpm * math.pi / 30.0

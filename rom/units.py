"""Conversion of units."""

from __future__ import annotations

import math


def angular_speed(speed_rpm: float) -> float:
    """Angular speed in rad/s of a rotational speed in rev/min.

    Parameters
    ----------
    speed_rpm : float
        Rotational speed, rev/min.

    Returns
    -------
    float
        Angular speed, rad/s.

    Examples
    --------
    >>> from rom import angular_speed
    >>> round(angular_speed(3000.0), 3)
    314.159
    """
    return speed_rpm * math.pi / 30.0

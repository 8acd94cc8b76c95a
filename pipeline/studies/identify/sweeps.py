"""What a sweep of the frequency makes of a peak: the part of its height that it reaches, and how much later.

The ring is integrated in time around the steady peak. The effect is taken as constant while the parameters are
fitted, and computed anew at their values until it does not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from nonlinear.peak_curves.measured_motion import Computed, Measured
    from nonlinear.problem import Problem
    from pipeline.studies.identify.result import Numbers

BANDS, SQUARE_ROOTS = 15.0, 6.0  # half width of the sweep: half bandwidths of the peak, and roots of the rate


def with_sweep(
    problem: Problem, names: Sequence[str], values: Numbers, measured: Measured, steady: Computed
) -> Measured:
    """A measured peak with the effect of its sweep at some values of the parameters."""
    from nonlinear.continuation.response_quantities import output_amplitude
    from nonlinear.peak_curves.parameter_family import with_parameters
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.run_up import half_bandwidth, run_up

    rate = measured.rate_hz_per_s
    modal, contact, wave, options = with_parameters(problem, names, values.tolist())
    ring = Ring(modal, contact, wave, measured.output)
    width = BANDS * half_bandwidth(ring) + SQUARE_ROOTS * float(np.sqrt(abs(rate)))
    low = max(options.frequency_hz[0], steady.frequency_hz - width)
    high = min(options.frequency_hz[1], steady.frequency_hz + width)
    sweep = run_up(ring, (low, high) if rate > 0.0 else (high, low), abs(rate))
    height = float(sweep.envelope_m[sweep.peak])
    return replace(
        measured,
        sweep_factor=height / output_amplitude(steady.point, measured.output),
        sweep_shift_hz=float(sweep.frequency_hz[sweep.peak]) - steady.frequency_hz,
    )

"""Errors of the highest amplitude of a branch: by neglected harmonics, and by time sampling."""

import math
from dataclasses import replace

from nonlinear.branches.branch import Branch
from nonlinear.branches.sampling_error import sampling_error
from nonlinear.contact.parameters import ContactParameters
from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator, TruncationEstimate
from nonlinear.response_curve import ResponseCurve


def with_peak_errors(
    curve: ResponseCurve,
    branch: Branch,
    contact: ContactParameters,
    estimator: TruncationErrorEstimator,
    truncation: TruncationEstimate | None = None,
) -> ResponseCurve:
    """A curve with the errors of its highest amplitude."""
    if truncation is None:
        wanted = estimator.continuation.options.truncation or estimator.continuation.options.harmonics == "auto"
        truncation = TruncationEstimate()
        if wanted:
            truncation = estimator.of_branch(branch.points, branch.peak_indices, main=False)
    sampling = sampling_error(estimator.continuation, contact, branch.points, curve.peak)
    return replace(
        curve,
        truncation_error=truncation.error,
        truncation_branch=truncation.branch,
        truncation_frequency_hz=truncation.omega / (2.0 * math.pi),
        motion_truncation_error=truncation.motion_error,
        sampling_error=sampling.amplitude,
        sampling_frequency_error=sampling.frequency,
    )

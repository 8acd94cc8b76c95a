"""Parameters of the continuation that are not options of the user."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class ContinuationParameters:
    """Thresholds of step control and of the acceptance tests.

    Lengths are arc lengths, see `nonlinear.continuation.metric`. The deviation of a step is the distance of the
    corrected from the predicted point.

    Attributes
    ----------
    target_deviation : float
        Deviation relative to the step length that step control aims at.
    max_deviation : float
        Largest deviation relative to the step length.
    smallest_factor, largest_factor : float
        Limits of the ratio of two successive step lengths.
    many_iterations : int
        Newton iterations above which the next step is at most `slow_factor` times as long.
    slow_factor : float
        See `many_iterations`.
    kink_step : float
        Steps up to this length may cross a kink of the curve, where the deviation does not shrink with the step.
    max_kink_deviation : float
        Largest deviation of these steps, relative to the step length.
    min_cosine : float
        Smallest cosine of the angle between the tangents at both ends of a longer step.
    max_mean_tangent_deviation : float
        Distance from the mean of the two tangents, relative to the step length, that a smooth segment may have.
    branch_point_gap : float
        Length of the gap that a curve may have at a branch point through which it goes straight on.
    same_branch_point : float
        Distance of two branch points that count as one.
    same_solution : float
        Relative distance of two solutions that count as one.
    max_restart_distance : float
        Distance of a solution from its guess with another number of harmonics, within which it is the same one.
    resonance_tolerance : float
        Relative distance in frequency within which a resonance counts as reached.
    frequency_scale : float
        Part of the frequency range that counts as unit arc length.
    """

    target_deviation: float = 0.08
    max_deviation: float = 0.6
    smallest_factor: float = 0.3
    largest_factor: float = 2.0
    many_iterations: int = 6
    slow_factor: float = 0.7
    kink_step: float = 0.01
    max_kink_deviation: float = 4.0
    min_cosine: float = 0.5
    max_mean_tangent_deviation: float = 0.02
    branch_point_gap: float = 1e-4
    same_branch_point: float = 1e-3
    same_solution: float = 1e-6
    max_restart_distance: float = 1.5
    resonance_tolerance: float = 1e-9
    frequency_scale: float = 0.1

    def __post_init__(self) -> None:
        """Check ranges."""
        for entry in fields(self):
            if not getattr(self, entry.name) > 0.0:
                raise ValueError(f"{entry.name} = {getattr(self, entry.name)}: must be above 0")
        if not self.smallest_factor < self.slow_factor < 1.0 < self.largest_factor:
            raise ValueError("allowed: smallest_factor < slow_factor < 1 < largest_factor")
        if self.min_cosine >= 1.0:
            raise ValueError(f"min_cosine = {self.min_cosine}: must be below 1")

"""Parameters of the continuation that are not options of the user."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class ContinuationParameters:
    """Thresholds of step control and of the acceptance tests.

    Lengths are arc lengths, see `nonlinear.continuation.metric`. The deviation of a step is the distance of the
    corrected from the predicted point.
    """

    target_deviation: float = 0.08  # deviation relative to the step length that step control aims at
    max_deviation: float = 0.6  # largest deviation relative to the step length
    smallest_factor: float = 0.3  # limits of the ratio of two successive step lengths
    largest_factor: float = 2.0  # limits of the ratio of two successive step lengths
    many_iterations: int = 6  # Newton iterations above which the next step is at most `slow_factor` times as long
    slow_factor: float = 0.7  # see `many_iterations`
    # steps up to this length may cross a kink of the curve, where the deviation does not shrink with the step
    kink_step: float = 0.01
    max_kink_deviation: float = 4.0  # largest deviation of these steps, relative to the step length
    min_cosine: float = 0.5  # smallest cosine of the angle between the tangents at both ends of a longer step
    # distance from the mean of the two tangents, relative to the step length, that a smooth segment may have
    max_mean_tangent_deviation: float = 0.02
    # length of the gap that a curve may have at a branch point through which it goes straight on
    branch_point_gap: float = 1e-4
    same_branch_point: float = 1e-3  # distance of two branch points that count as one
    same_solution: float = 1e-6  # relative distance of two solutions that count as one
    # distance of a solution from its guess with another number of harmonics, within which it is the same one
    max_restart_distance: float = 1.5
    resonance_tolerance: float = 1e-9  # relative distance in frequency within which a resonance counts as reached
    frequency_scale: float = 0.1  # part of the frequency range that counts as unit arc length

    def __post_init__(self) -> None:
        """Check ranges."""
        for entry in fields(self):
            if not getattr(self, entry.name) > 0.0:
                raise ValueError(f"{entry.name} = {getattr(self, entry.name)}: must be above 0")
        if not self.smallest_factor < self.slow_factor < 1.0 < self.largest_factor:
            raise ValueError("allowed: smallest_factor < slow_factor < 1 < largest_factor")
        if self.min_cosine >= 1.0:
            raise ValueError(f"min_cosine = {self.min_cosine}: must be below 1")

"""The modes of a ring in several waves at once: one row for each wave."""

from dataclasses import dataclass

from rom.cyclic.reduced_model import Array, ComplexArray


@dataclass(frozen=True)
class WaveModes:
    """Natural frequencies, damping and relative contact motion of m modes in each of J waves.

    Attributes
    ----------
    angular_frequency : (J, m) array
        Natural frequencies, rad/s.
    damping : (J, m) array
        Modal damping coefficients 2 zeta_m w_m, 1/s.
    relative : (J, 3 n_c, m) complex array
        Relative contact motion of the modes, right - exp(i phase) left.

    Examples
    --------
    >>> from rom import ReducedModel, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, contact_left=n)
    >>> waves = modal_model(model, damping_ratio=0.01).waves(np.array([0.0, np.pi]))
    >>> waves.angular_frequency.shape, abs(waves.relative[:, 2, 0]).round(9).tolist()
    ((2, 1), [0.0, 2.0])
    """

    angular_frequency: Array
    damping: Array
    relative: ComplexArray

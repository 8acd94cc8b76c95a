"""Modal coordinates over one time step, exact for a force that varies linearly over the step (first-order hold)."""

import numpy as np

from nonlinear.contact.parameters import Array


def propagation(angular_frequency: Array, damping: Array, step: float) -> tuple[Array, Array]:
    """Coefficients of eta'' + c eta' + w^2 eta = f over one step, f linear from f_0 to f_1.

    Shapes: `angular_frequency` (m,), `damping` (m,), returns `position, rate` (4, m).
    """
    from scipy.linalg import expm

    size = angular_frequency.size
    generator = np.zeros((size, 4, 4))  # of eta, eta', f, df/dt
    generator[:, 0, 1] = generator[:, 1, 2] = generator[:, 2, 3] = 1.0
    generator[:, 1, 0], generator[:, 1, 1] = -(angular_frequency**2), -damping
    after = expm(generator * step)
    of_last = after[:, :2, 3] / step
    columns = np.stack([after[:, :2, 0], after[:, :2, 1], after[:, :2, 2] - of_last, of_last])
    return np.ascontiguousarray(columns[:, :, 0]), np.ascontiguousarray(columns[:, :, 1])

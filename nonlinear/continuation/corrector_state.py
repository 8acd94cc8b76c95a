"""What the kernels of the corrector are given and what they write."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.contact.return_map import Integers

# components (a, b) of the contact force and of the motion for which df_a/dx_b may be other than zero
FORCES, MOTIONS = (0, 1, 0, 1, 2), (0, 1, 2, 2, 2)
PAIRS = len(FORCES)


class Path(NamedTuple):
    """What the parameter is (see `Parameter`): the frequency, or the interference."""

    of_frequency: bool  # the parameter is the frequency
    omega: float  # else the excitation frequency, rad/s
    origin: float  # the parameter at which the loads at rest are those given
    load: Array  # (n_c,), unclipped loads at rest, N
    # `shift`, `defect_rate`: (n_c,), see `InterferenceChange`
    shift: Array
    defect_rate: Array


class Structure(NamedTuple):
    """The structure as the kernels take it."""

    relative: ComplexArray  # (H+1, 3 n_c, m), relative contact motion of the modes
    adjoint: ComplexArray  # (H+1, m, 3 n_c), its adjoint
    force: ComplexArray  # (H+1, m), external modal force
    # `stiffness`, `damping`: (H+1, m), w_m^2 and 2 zeta_m w_m of the modes of each harmonic, and what the flow adds
    stiffness: ComplexArray
    damping: ComplexArray
    inertia: float  # coefficient of the squared frequency: 1, with Coriolis forces 0 of poles in place of modes
    odd: bool  # no even harmonics (see `HarmonicBalance`)
    floor: float  # added to the norm of the displacement in the relative error, m
    defect: Array  # (n,), residual that counts as zero, m
    floating: Array  # (r, 3 n_c), see `HarmonicBalance.floating_motions`
    path: Path  # what the parameter is


class Plane(NamedTuple):
    """The arc-length constraint (see `corrector.NormalPlane`) and the tolerances of the iteration."""

    unknown: Array  # (n,), x of the predicted point
    direction: Array  # (n,), x part of the normal
    parameter: float  # p of the predicted point
    direction_parameter: float  # p part of the normal
    length: float  # scale of displacements in the metric
    parameter_scale: float  # scale of the parameter in the metric
    max_distance: float  # from the predicted point
    lowest: float  # what the parameter must exceed
    # `tolerance`, `round_off`: see `ConvergenceMonitor`
    tolerance: float
    round_off: float


class Iterate(NamedTuple):
    """State (x, p) and all that belongs to it; all arrays are written."""

    unknown: Array  # (n,), x
    residual: Array  # (n,), R
    motion: Array  # (2H+1, n_c, 3), another view of `unknown`
    parameter: Array  # (1,), p
    change: Array  # (1,), p part of the last solution of the bordered system, scaled
    # `force`, `jacobian`, `state`: see `ContactForces`
    force: Array
    jacobian: Array
    state: Integers
    tangent: Array  # (n,), x part of the last solution of the bordered system, scaled


class Condensation(NamedTuple):
    """A real basis Q of r motions of the contact face, and the scratch of its factors; r = 0: there is none."""

    motions: Array  # (3 n_c, r), Q, orthonormal
    transposed: Array  # (r, 3 n_c), its transpose
    products: Array  # (r r, 5 n_c), products of its rows a and b of a node, in the order node, pair of components
    relative: ComplexArray  # (H+1, r, m), Q^T B_h phi
    adjoint: ComplexArray  # (H+1, m, r), its adjoint
    static: Array  # (r, r), G^ of harmonic 0
    weighted: ComplexArray  # (r, m), `relative` divided by the denominators
    receptance: ComplexArray  # (r, r), G^
    flexibility: Array  # (H, 2 r, 2 r), G^ of harmonics 1 .. H for real and imaginary parts
    stiffness: Array  # (5 n_c, (2H+1)^2), K of the factors in the order node, pair of components
    coupling: Array  # (r r, (2H+1)^2), Q^T K Q
    # `projected`, `moved`: (R, R) with R = (2H+1) r, Q^T K Q and G^ Q^T K Q in the order coefficient, motion
    projected: Array
    moved: Array
    force: Array  # (2H+1, 3 n_c), K x, and Q u
    reduced: Array  # (2H+1, r), Q^T K x, and u
    probes: Array  # (3, n + 1), random numbers


class Workspace(NamedTuple):
    """Scratch of the kernels."""

    denominators: ComplexArray  # (H+1, m), of the modal sum
    rates: ComplexArray  # (H+1, m), their derivatives in w
    coordinates: ComplexArray  # (H+1, m), modal coordinates
    weighted_force: ComplexArray  # (H+1, m), modal forces
    contact_force: ComplexArray  # (H+1, 3 n_c), f
    response: ComplexArray  # (H+1, 3 n_c), d
    # `dR_dp`, `tangent`: (n,), scaled
    dR_dp: Array
    tangent: Array
    unsolved: Array  # (n,), the residual that a solution is sought for
    of_dof: Array  # (2H+1,), coefficients of one displacement
    shares: Array  # (r,), parts of a residual in motions of bodies that contacts alone hold
    # `other_shift`: (n_c,), `other_defect_rate`: (n,); another parameter, see `InterferenceChange`
    other_shift: Array
    other_defect_rate: Array
    condensed: Condensation
    # of dense factors, without entries where there are none
    # (H+1, 3 n_c, 3 n_c), G; that of a fixed frequency, and G^(0), which does not depend on it, are given
    receptance: ComplexArray
    weighted: ComplexArray  # (3 n_c, m), the modes divided by their denominators
    # df/dx in rows: force coefficient, node, force component; columns: displacement component, coefficient
    by_row: Array
    coupling: Array  # (n, n), G df/dx; columns in the order node, component, coefficient
    columns: Integers  # (n,), columns of `coupling` that are active
    active: Integers  # (n,), unknowns that are active
    passive: Integers  # (n,), unknowns that are passive
    # bordered system; used as far as the number of unknowns needs
    matrix: Array
    pivots: NDArray[np.int32]
    right: Array

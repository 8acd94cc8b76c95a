"""A ring of identical blades, the number of blades that a motion needs, and the state of the ring."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactError, ContactParameters
from nonlinear.options import Excitation
from rom import ModalModel, RelativeReceptance, RingModes


@dataclass(frozen=True)
class Ring:
    """Blades that touch their neighbours, under a travelling-wave excitation.

    Attributes
    ----------
    modal : rom.ModalModel or rom.SectorModes
        Modes with free contacts, with their damping: of a blade alone, or of a sector with a disk wave by wave.
    contact : ContactParameters
        Parameters of the contact nodes of one pair of faces.
    excitation : Excitation
        Engine order and force.
    output : str
        Name of the output of which the amplitude is wanted.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import Ring
    >>> ring = Ring(modal, contact, excitation)
    >>> round(ring.shift(3) / np.pi, 6), ring.blades(3)  # one blade suffices where the contact is against ground
    (0.5, 1)
    """

    modal: RingModes
    contact: ContactParameters
    excitation: Excitation
    output: str = "tip"

    def __post_init__(self) -> None:
        """Check that the contact fits the model."""
        if self.contact.n_contacts != self.modal.n_contacts:
            raise ContactError(
                f"contact: parameters of {self.contact.n_contacts} nodes, allowed: {self.modal.n_contacts}, "
                "as the model"
            )

    @property
    def has_disk(self) -> bool:
        """Whether the sectors are joined at a disk, with other modes in each wave."""
        return not isinstance(self.modal, ModalModel)

    @property
    def phase(self) -> float:
        """Inter-blade phase angle psi of the excitation, rad."""
        return self.modal.phase(self.excitation.engine_order)

    @property
    def wave_blades(self) -> int:
        """Smallest number of blades that carries the wave of the excitation: N_b / gcd(N_b, EO)."""
        return self.blades(0)

    def blades(self, nodal_diameter: int) -> int:
        """Smallest number q of blades that carries the wave and a perturbation, q psi = q kappa = 0 mod 2 pi.

        Parameters
        ----------
        nodal_diameter : int
            k of the perturbation; kappa = 2 pi k / N_b is the phase shift from blade to blade beside that of the
            wave.

        Returns
        -------
        int
            Number of blades; 1 for a single structure, and where nothing joins the blades: contact against ground
            and no disk.
        """
        n_blades = self.modal.n_blades
        if n_blades is None or not self.modal.neighbours_coupled:
            return 1
        numbers = (self.excitation.engine_order, nodal_diameter)
        return math.lcm(*(n_blades // math.gcd(n_blades, number) for number in numbers))

    def shift(self, nodal_diameter: int) -> float:
        """Phase shift kappa = 2 pi k / N_b of a perturbation, rad; 0 for a single structure.

        Parameters
        ----------
        nodal_diameter : int
            k of the perturbation.
        """
        return 2.0 * math.pi * nodal_diameter / (self.modal.n_blades or 1)

    def sampled_phases(self) -> Array:
        """Phases 0, about pi / 2 and pi from one blade to the next that the ring can have, (3,), rad."""
        quarters = 2.0 * math.pi * np.array([0.0, 0.25, 0.5])
        if not self.has_disk:
            return quarters
        pitch = self.shift(1)
        return pitch * np.rint(quarters / pitch)

    def receptance(self, n_harmonics: int) -> RelativeReceptance:
        """Receptance of the wave of the excitation with harmonics 0 to H.

        Parameters
        ----------
        n_harmonics : int
            Number of harmonics H.
        """
        harmonics, excitation = tuple(range(n_harmonics + 1)), self.excitation
        return RelativeReceptance(self.modal, self.phase, harmonics, excitation.force, excitation.factors)

    @cached_property
    def excited(self) -> RelativeReceptance:
        """Receptance of the wave in harmonics 0 to the highest of the excitation."""
        return self.receptance(self.receptance(1).excited_harmonics[-1])

    def free_response(self, omega: float) -> ComplexArray:
        """Modal coordinates without contact, (n_h, m): each harmonic in the modes of its own wave.

        Parameters
        ----------
        omega : float
            Excitation frequency, rad/s.
        """
        no_force = np.zeros((len(self.excited.harmonics), 3 * self.modal.n_contacts), dtype=complex)
        return self.excited.modal_response(omega, no_force)[0]


@dataclass(frozen=True)
class RingState:
    """State of q blades at the beginning of a period, theta = omega t = 0 of blade 0.

    Attributes
    ----------
    coordinates, rates : (q, m) float
        Modal coordinates of all modes of each blade and their rates. With a disk, where the modes belong to waves,
        the sum of the waves (see `JoinedSectors`).
    slider : (q, n_c, 2) float
        Positions of the sliders, m.
    force : (q, n_c, 3) float
        Contact force on the right nodes, N.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import Ring, RingIntegrator
    >>> integrator = RingIntegrator.of(Ring(modal, contact, excitation), omega=1.0)
    >>> rest = integrator.at_rest().repeated(3)
    >>> rest.n_blades, rest.coordinates.shape
    (3, (3, 1))
    """

    coordinates: Array
    rates: Array
    slider: Array
    force: Array

    @property
    def n_blades(self) -> int:
        """Number q of blades."""
        return len(self.coordinates)

    def repeated(self, n_blades: int) -> "RingState":
        """The same motion on a ring of `n_blades`, a multiple of q.

        Parameters
        ----------
        n_blades : int
            Number of blades.
        """
        times, rest = divmod(n_blades, self.n_blades)
        if rest:
            raise ValueError(f"blades: {n_blades}, allowed: multiples of {self.n_blades}")
        parts = self.coordinates, self.rates, self.slider, self.force
        return RingState(*(np.concatenate([part] * times) for part in parts))

"""Quantities of a solved point: amplitude of the output, its derivative along the curve, further outputs by name,
work per cycle.
"""

import cmath
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import Measure, OptionsError
from rom.cyclic.receptance import RelativeReceptance


def output_components(outputs: Iterable[str], name: str) -> tuple[str, ...]:
    """The outputs of a model that make an output: one, or NAME_x, NAME_y, NAME_z of a vector."""
    outputs = tuple(outputs)
    if name in outputs:
        return (name,)
    parts = tuple(f"{name}_{axis}" for axis in "xyz")
    if all(part in outputs for part in parts):
        return parts
    raise OptionsError(f"outputs: {name!r}, allowed: {', '.join(outputs)}, or the name in front of _x, _y and _z")


@dataclass(frozen=True)
class Amplitude:
    """Largest abs(x(theta)) over a period."""

    value: float  # max abs(x), m
    angle: float  # theta where it is reached, rad
    sign: float  # sign of x there


def largest_amplitude(harmonics: ComplexArray) -> Amplitude:
    """The amplitude of x(theta) = x_0 + Re sum_h x_h exp(i h theta) from its coefficients (H+1,).

    Closed form for one harmonic; else the largest of 32 H samples, improved by Newton's method on x' = 0.
    """
    static, first = harmonics[0].real, harmonics[1]
    if harmonics.size > 2 and harmonics[2:].any():
        from nonlinear.continuation.response_kernels import largest_displacement

        return Amplitude(*largest_displacement(np.ascontiguousarray(harmonics, dtype=complex)))
    sign = -1.0 if static < 0.0 else 1.0
    angle = -cmath.phase(sign * first)
    return Amplitude(float(abs(static) + abs(first)), angle, sign)


def output_harmonics(point: SolutionPoint, output: str) -> ComplexArray:
    """Fourier coefficients of the output at a point, (H+1,), m."""
    return output_under_forces(point.balance.receptance, point.omega, point.contact, output)


def output_amplitude(point: SolutionPoint, output: str, mean: Measure = None) -> float:
    """Largest abs(x(t)) of the output at a point, m; with a given `mean` displacement in place of harmonic 0, or of
    its first harmonic alone."""
    return largest_amplitude(with_mean(output_harmonics(point, output), mean)).value


def with_mean(harmonics: ComplexArray, mean: Measure) -> ComplexArray:
    """The coefficients (H+1,) with a given mean in place of harmonic 0; None: unchanged; "harmonic_1": that alone."""
    if mean is None:
        return harmonics
    if mean == "harmonic_1":
        return np.where(np.arange(harmonics.size) == 1, harmonics, 0.0)
    return np.append(complex(mean), harmonics[1:])


def output_under_forces(
    receptance: RelativeReceptance, omega: float, contact: ContactForces, output: str
) -> ComplexArray:
    """Fourier coefficients of the output under the excitation and given contact forces, (H+1,), m."""
    coordinates, _ = receptance.modal_response(omega, complex_force(contact))
    return receptance.output(output, coordinates)


def amplitude_derivative(point: SolutionPoint, output: str, mean: Measure = None) -> float:
    """dA/ds: derivative of the amplitude of the output with respect to the arc length, m.

    With the coefficients x_h of the output and the angle theta at which abs(x) is largest,
    dA/ds = sign(x(theta)) Re sum_h dx_h/ds exp(i h theta). With a given `mean` x_0 is that, and constant.
    """
    from nonlinear.continuation.response_kernels import moving_forces

    receptance, contact, (dx_ds, domega_ds) = point.balance.receptance, point.contact, point.tangent
    forces = moving_forces(contact.force, contact.jacobian, dx_ds.reshape(-1, *contact.force.shape[1:]))
    coordinates, dcoordinates_domega = receptance.modal_response(point.omega, forces[..., 0])
    harmonics, derivative = (receptance.output(output, part) for part in (coordinates, dcoordinates_domega))
    derivative = domega_ds * derivative + (receptance.output_rows(output, point.omega) * forces[..., 1]).sum(axis=1)
    if mean is not None:
        harmonics = with_mean(harmonics, mean)
        derivative = with_mean(derivative, mean if mean == "harmonic_1" else 0.0)
    amplitude = largest_amplitude(harmonics)
    turn = np.exp(1j * amplitude.angle * np.arange(derivative.size))
    return float(amplitude.sign * (derivative @ turn).real)


@dataclass(frozen=True)
class Responses:
    """Output and energy balance of P points with the same harmonics.

    Work is per cycle and blade, in J. A force with coefficients F on a displacement with coefficients X in harmonic h
    does the work W = -pi h Im(conj(F) X).
    """

    # (P, H+1, n_c, 3), Fourier coefficients of relative displacement and contact force, m and N
    displacement: ComplexArray
    force: ComplexArray  # (P, H+1, n_c, 3), Fourier coefficients of relative displacement and contact force, m and N
    output: ComplexArray  # (P, H+1), those of the output, m
    outputs: dict[str, ComplexArray]  # (P, H+1, c), those of further outputs of c components
    excitation: Array  # (P,), work of the excitation
    flow: Array  # (P,), work of the flow
    damping: Array  # (P,), work dissipated by structural damping
    friction: Array  # (P,), work dissipated by friction

    @property
    def energy_error(self) -> Array:
        """Difference of work input and dissipated work, relative to the larger of the two, (P,)."""
        scale = np.maximum(np.abs(self.excitation) + np.abs(self.flow), np.abs(self.damping) + np.abs(self.friction))
        return np.abs(self.excitation + self.flow - self.damping - self.friction) / np.maximum(scale, 1e-300)


def evaluate_responses(points: Sequence[SolutionPoint], output: str, others: Sequence[str] = ()) -> Responses:
    """Outputs and energy balance of points that have the same balance."""
    receptance = points[0].balance.receptance
    omega = np.array([point.omega for point in points])
    force = _stacked([point.contact.force for point in points])
    displacement = _stacked([point.displacement for point in points])
    coordinates = receptance.coordinates(omega, force)
    order = np.asarray(receptance.harmonics, dtype=float)
    excitation = (receptance.modal_force.conj() * coordinates).imag.sum(axis=-1)
    flow, damping = receptance.modes.works(coordinates, order, omega)
    by_node = (len(points), order.size, -1, 3)
    displacement, force = displacement.reshape(by_node), force.reshape(by_node)
    return Responses(
        displacement=displacement,
        force=force,
        output=receptance.output(output, coordinates),
        outputs={name: _components(receptance, coordinates, name) for name in others},
        excitation=-np.pi * (excitation @ order),
        flow=flow,
        damping=damping,
        friction=friction_work(displacement, force).sum(axis=-1),
    )


def friction_work(displacement: ComplexArray, force: ComplexArray) -> Array:
    """Work that friction dissipates at each node per cycle, (..., n_c), J.

    From Fourier coefficients (..., H+1, n_c, 3) of relative displacement, m, and contact force on the right node, N.
    """
    order = np.arange(displacement.shape[-3])
    return np.asarray(np.pi * np.einsum("h,...hna->...na", order, (force.conj() * displacement).imag).sum(axis=-1))


def _components(receptance: RelativeReceptance, coordinates: ComplexArray, name: str) -> ComplexArray:
    """Fourier coefficients (P, H+1, c) of an output of one component, or of a vector."""
    parts = output_components(receptance.modal.output_names, name)
    return np.stack([receptance.output(part, coordinates) for part in parts], axis=-1)


def _stacked(coefficients: list[Array]) -> ComplexArray:
    """Real coefficients of the points, (2H+1, n_c, 3) each, as complex ones: (P, H+1, 3 n_c)."""
    rows = np.stack([values.reshape(values.shape[0], -1) for values in coefficients], axis=1)
    return to_complex(rows).transpose(1, 0, 2)


def complex_force(contact: ContactForces) -> ComplexArray:
    """Contact force coefficients f_R^(h), (H+1, 3 n_c)."""
    return to_complex(contact.force.reshape(contact.force.shape[0], -1))

"""Does a motion persist? Growth rates of small disturbances along a curve.

Of a linear blade each disturbance decays with zeta w; between the two folds of a nonlinear curve one grows.
"""

import matplotlib.pyplot as plt

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model
from shroud import plot_curve

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[0.0], [0.0], [1.0]], load=[1.0])
modal, options = modal_model(model, damping_ratio=0.01), SolverOptions((0.1, 0.35), harmonics=7)
stop = ContactParameters.shared(1, normal_stiffness=3.0, tangential_stiffness=0.0, friction=0.0, interference=-1.0)
curve = forced_response(modal, stop, Excitation(0, 0.1), options)
axes = plt.gca()
plot_curve(axes, curve, unit="m")  # dashed where it is unstable
axes.set(xlabel="excitation frequency [Hz]", ylabel="largest displacement over a period [m]")
plt.savefig("is_it_stable.png", dpi=100)
unstable = curve.frequency_hz[~curve.stable]
print(f"unstable from {unstable.min():.4f} to {unstable.max():.4f} Hz:", [b.kind.value for b in curve.bifurcations])
below = curve.amplitude_m < 1.0  # the gap stays open: a linear blade
print(f"rate of decay with an open gap: {-curve.growth_rate[below].max():.5f} 1/s")

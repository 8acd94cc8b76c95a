"""How many harmonics? The truncation error of the peak, and "auto".

The more sharply a contact opens, the more harmonics its motion has. The estimate is there without a finer solution.
"""

import matplotlib.pyplot as plt

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import ReducedModel, modal_model

model = ReducedModel.from_matrices([[1.0]], [[1.0]], [[0.0], [0.0], [1.0]], load=[1.0])
modal = modal_model(model, damping_ratio=0.03)
stop = ContactParameters.shared(1, normal_stiffness=3.0, tangential_stiffness=0.0, friction=0.0, interference=-1.0)
for harmonics in (1, 3, 7, 15, "auto"):
    curve = forced_response(modal, stop, Excitation(0, 0.3), SolverOptions((0.1, 0.35), harmonics=harmonics))
    peak = curve.peak.amplitude_m
    plt.plot(curve.frequency_hz, curve.amplitude_m, label=f"H {harmonics}")
    print(
        f"H {harmonics} ({curve.harmonics}): peak {peak:.4f} m, error estimate {100.0 * curve.truncation_error:.3f} %"
    )
plt.xlabel("frequency [Hz]")
plt.ylabel("amplitude [m]")
plt.legend()
plt.savefig("number_of_harmonics.png", dpi=100)
print(f"peak with auto: {peak:.4f} m")

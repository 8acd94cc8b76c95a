"""Time and accuracy of the contact elements: `python benchmarks/contact_element.py` from the project folder.

Prints, for 9 nodes under the uncoupled law in random states, the time of one evaluation (force and Jacobian) of the
exact and of the sampled element, and the largest force error of the sampled one relative to the largest force.
"""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from nonlinear import ContactParameters, SolverOptions, contact_element
from nonlinear.contact.parameters import ContactElement

NODES = 9
SAMPLES = (64, 256, 1024)


def states(n_harmonics: int, count: int) -> tuple[ContactParameters, list[NDArray[np.float64]]]:
    """A contact with gaps and interferences, and random motions of all sizes, from full stick to lift-off."""
    rng = np.random.default_rng(n_harmonics)
    contact = ContactParameters.shared(
        NODES,
        normal_stiffness=9.0,
        tangential_stiffness=7.0,
        friction=0.4,
        interference=0.8 * rng.normal(size=NODES),
        preload=0.3 * np.abs(rng.normal(size=NODES)),
    )
    shape = (2 * n_harmonics + 1, NODES, 3)
    return contact, [0.7 * rng.choice([0.1, 1.0, 3.0]) * rng.normal(size=shape) for _ in range(count)]


def microseconds(element: ContactElement, motions: list[NDArray[np.float64]], repeats: int) -> float:
    """Median over `repeats` of the mean time of an evaluation; the first, which compiles, is not counted."""
    element.evaluate(motions[0])
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for motion in motions:
            element.evaluate(motion)
        times.append((time.perf_counter() - start) / len(motions))
    return 1e6 * float(np.median(times))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--harmonics", type=int, nargs="+", default=[1, 2, 3, 5, 7])
    parser.add_argument("--motions", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=7)
    arguments = parser.parse_args()
    print("  H  exact us" + "".join(f"  {n:>5} us     error" for n in SAMPLES))
    for n_harmonics in arguments.harmonics:
        contact, motions = states(n_harmonics, arguments.motions)
        exact = contact_element(contact, n_harmonics, SolverOptions((1.0, 2.0), integration="exact"))
        line = f"{n_harmonics:3d}  {microseconds(exact, motions, arguments.repeats):8.1f}"
        for samples in SAMPLES:
            options = SolverOptions((1.0, 2.0), integration="sampled", samples=samples)
            element = contact_element(contact, n_harmonics, options)
            error = 0.0
            for motion in motions:
                force = exact.evaluate(motion).force
                error = max(error, np.max(np.abs(element.evaluate(motion).force - force)) / np.max(np.abs(force)))
            line += f"  {microseconds(element, motions, arguments.repeats):8.1f}  {error:8.1e}"
        print(line)


if __name__ == "__main__":
    main()

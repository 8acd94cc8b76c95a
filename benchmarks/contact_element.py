"""Time and accuracy of the contact elements: `python benchmarks/contact_element.py` from the project folder.

Prints, for 9 nodes of two sliders each in random states, the time of one evaluation (force and Jacobian) of the
event-driven and of the sampled element (AFT), and the largest force error of the sampled one relative to the largest
force.
"""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from nonlinear import ContactParameters, SolverOptions
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import ContactElement

NODES = 9
SAMPLES = (64, 256, 1024)


def states(n_harmonics: int, count: int) -> tuple[ContactParameters, list[NDArray[np.float64]]]:
    """A contact with gaps and interferences, and random displacements of all sizes, from full stick to lift-off."""
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


def microseconds(element: ContactElement, displacements: list[NDArray[np.float64]], repeats: int) -> float:
    """Median over `repeats` of the mean time of an evaluation; the first, which compiles, is not counted."""
    element.evaluate(displacements[0])
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for displacement in displacements:
            element.evaluate(displacement)
        times.append((time.perf_counter() - start) / len(displacements))
    return 1e6 * float(np.median(times))


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--harmonics", type=int, nargs="+", default=[1, 2, 3, 5, 7])
    parser.add_argument("--states", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args(arguments)
    print("  H  exact us" + "".join(f"  {n:>5} us     error" for n in SAMPLES))
    for n_harmonics in options.harmonics:
        contact, displacements = states(n_harmonics, options.states)
        exact = contact_element(contact, n_harmonics, SolverOptions((1.0, 2.0), integration="exact"))
        forces = [exact.evaluate(displacement).force for displacement in displacements]
        line = f"{n_harmonics:3d}  {microseconds(exact, displacements, options.repeats):8.1f}"
        for samples in SAMPLES:
            sampled = SolverOptions((1.0, 2.0), integration="sampled", samples=samples)
            element = contact_element(contact, n_harmonics, sampled)
            errors = [
                np.abs(element.evaluate(displacement).force - force).max() / np.abs(force).max()
                for displacement, force in zip(displacements, forces, strict=True)
            ]
            line += f"  {microseconds(element, displacements, options.repeats):8.1f}  {max(errors):8.1e}"
        print(line)


if __name__ == "__main__":
    main()

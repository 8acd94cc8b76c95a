"""Claims of stability against rings of blades integrated in time.

    shroud run scenes/dummy.toml                                        # and the other scenes
    python benchmarks/ring_validation.py out/dummy out/figure5 out/figure6

Points are drawn with a seed from all branches of all curves. Each is solved again with more harmonics; its Floquet
exponents for all nodal diameters that a small ring carries say whether it is stable, and against which pattern it is
least stable. That ring is integrated from the motion, a little disturbed. Writes ring_validation.csv and
ring_validation.md: whether the ring stays or leaves as claimed, and the growth rate beside that of the exponents.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from tables import OUT, table_of, write_results

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.contact.fourier import to_real
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import with_more_harmonics
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from rom import modal_model, read_reduced_model
from rom.linear_algebra.threads import one_blas_thread

MARGINAL = 1e-3  # rates below this times omega: the accuracy of the exponents does not tell stable from unstable


class Point(NamedTuple):
    """A solved point of a branch."""

    scene: str
    curve: int
    branch: int
    ring: Ring
    omega: float
    displacement: np.ndarray  # (2H+1, n_c, 3)


def main(arguments: list[str] | None = None) -> int:
    """Draw points and compare; exit status 1 where a ring contradicts a claim that is not marginal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="output folders of runs")
    parser.add_argument("--points", type=int, default=40, help="how many to draw (40), evenly over the folders")
    parser.add_argument("--seed", type=int, default=1, help="another seed draws other points (1)")
    parser.add_argument("--blades", type=int, default=24, help="most blades of a ring (24)")
    parser.add_argument("--skip", type=int, default=0, help="points that are drawn but not judged, from the first on")
    parser.add_argument("--out", type=Path, default=OUT / "rings", help="output folder")
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(options.seed)
    rows: list[dict[str, Any]] = []
    with one_blas_thread():
        for number in range(options.points):
            folder = options.folders[number % len(options.folders)]
            point = draw(folder, rng)
            if number < options.skip:
                continue
            rows.append(judged(number, point, options.blades))
            print(*rows[-1].values(), sep="  ", file=sys.stderr, flush=True)
            write_results(options.out, "ring_validation", rows, table_of(rows) + "\n")
    return int(any(row["agrees"] == "no" for row in rows))


def draw(folder: Path, rng: np.random.Generator) -> Point:
    """A point with contact forces that vary in the cycle."""
    curves = json.loads((folder / "summary.json").read_text())["curves"]
    while True:
        number = int(rng.integers(len(curves)))
        with h5py.File(folder / "response.h5") as file:
            group = file["curve"][str(number)]
            branches = [group, *group.get("branch", {}).values()]
            branch = int(rng.integers(len(branches)))
            data, attributes = branches[branch], dict(group.attrs)
            index = int(rng.integers(len(data["frequency_hz"])))
            nonlinear = data["slipping"][index] + data["separating"][index] > 0 and data["iterations"][index] > 0
            frequency, rows = data["frequency_hz"][index], data["relative_displacement"][index]
        if nonlinear:
            ring = ring_of(folder / curves[number]["rom"], attributes)
            return Point(folder.name, number, branch, ring, 2.0 * np.pi * frequency, to_real(rows))


def ring_of(rom: Path, attributes: dict[str, Any]) -> Ring:
    """The ring of a curve from the attributes of its group in response.h5."""
    modal = modal_model(read_reduced_model(rom), damping_ratio=attributes["response.damping_ratio"])
    names = ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload", "law")
    values = {name: attributes[f"contact.{name}"] for name in names}
    contact = ContactParameters.shared(modal.n_contacts, **values, area=modal.area)
    excitation = Excitation(int(attributes["excitation.engine_order"]), float(attributes["excitation.force"]))
    return Ring(modal, contact, excitation)


def rates(point: Point, balance: HarmonicBalance, most_blades: int) -> dict[int, float]:
    """Nodal diameter -> largest growth rate, 1/s; those that a ring of so many blades carries."""
    jacobian = balance.element.evaluate(point.displacement).jacobian
    n_blades = point.ring.modal.n_blades or 1
    result = {}
    for k in (k for k in range(n_blades // 2 + 1) if point.ring.blades(k) <= most_blades):
        analysis = FloquetAnalysis.of(balance.receptance, point.ring.contact, kappa=point.ring.shift(k))
        found = analysis.exponents(point.displacement, jacobian, point.omega)
        result[k] = float(found[0].real) if found.size else -np.inf
    return result


def judged(number: int, point: Point, most_blades: int) -> dict[str, Any]:
    """The claim about a point and what a ring says, as a row of the table."""
    ring, started = point.ring, time.perf_counter()
    point = point._replace(displacement=with_more_harmonics(ring, point.omega, point.displacement))
    harmonics = (len(point.displacement) - 1) // 2
    options = SolverOptions((1.0, 2.0), harmonics=harmonics)
    balance = build_harmonic_balance(ring.modal, ring.contact, ring.excitation, options)
    by_diameter = rates(point, balance, max(most_blades, ring.wave_blades))
    worst = max(by_diameter, key=by_diameter.__getitem__)
    n_blades = ring.blades(worst)
    carried = [k for k in by_diameter if n_blades % ring.blades(k) == 0]
    rate = max(by_diameter[k] for k in carried)
    motion = integrate_ring(ring, point.omega, point.displacement, nodal_diameter=worst, limits=limits_of(rate))
    marginal = abs(rate) < MARGINAL * point.omega
    agrees = motion.stays == (rate < 0.0)
    measured = np.isfinite(motion.growth_rate) and not marginal
    apart = abs(motion.growth_rate - rate)
    return {
        "point": number,
        "scene": point.scene,
        "curve": point.curve,
        "branch": point.branch,
        "Hz": f"{point.omega / (2.0 * np.pi):.5g}",
        "H": harmonics,
        "k": worst,
        "blades": n_blades,
        "exponent 1/s": f"{rate:.4g}",
        "ring 1/s": f"{motion.growth_rate:.4g}",
        "difference": f"{100.0 * apart / abs(rate):.1f} %" if measured else "-",
        "difference / omega": f"{apart / point.omega:.1e}",
        "stays": "yes" if motion.stays else "no",
        "agrees": "yes" if agrees else "marginal" if marginal else "no",
        "stored um": f"{1e6 * motion.started_m:.4g}",
        "ring um": f"{1e6 * motion.amplitude_m:.4g}",
        "motion": described(motion.repeats_after, motion.settled),
        "periods": motion.periods,
        "seconds": f"{time.perf_counter() - started:.1f}",
    }


def limits_of(rate: float) -> RingLimits:
    """More periods for what changes slowly would take long: the judgement then rests on the rate."""
    return replace(RingLimits(), most_periods=600 if rate < 0.0 else 1000)


def described(repeats_after: int, settled: bool) -> str:
    """Words for a motion."""
    words = {0: "quasi-periodic", 1: "periodic"}.get(repeats_after, f"period {repeats_after}")
    return words if settled else f"{words}, not settled"


if __name__ == "__main__":
    sys.exit(main())

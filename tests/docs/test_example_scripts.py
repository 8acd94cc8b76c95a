"""The scripts of examples/ run, and the number that each ends with is known from elsewhere."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

from docs.execute import DOCS, EXAMPLES, run_example

RING = np.sqrt(1.0 + 4.0 * 0.5) / (2.0 * np.pi)  # opposite neighbours
# the number, its relative tolerance and where it is from
KNOWN = {
    "blade_from_geometry": (60.0, 0.2),  # a Craig-Bampton frequency is above that of the mesh, by less than 1e-4
    "export_to_matlab": (1.3795, 1e-4),  # `forced_response`
    "flutter_margin": (-0.001, 1e-9),  # (0.004 - 2 * 0.003 sin psi) / 2 at a quarter of the ring
    "gap_and_lift_off": (0.71478, 1e-4),  # 2 f1 f2 / (f1 + f2)
    "hysteresis_loop": (4.1847, 1e-4),  # the work of the curve
    "is_it_stable": (0.01, 1e-3),  # zeta w
    "jenkins_oscillator": (4.0 * (36.8386 - 1.0 / 3.0), 1e-4),  # the area of the loop of one slider
    "mistuned_ring": (1.389, 1e-2),  # below Whitehead's (1 + sqrt(12)) / 2
    "nonlinear_mode": (0.2291, 2e-3),  # friction work over energy, largest
    "number_of_harmonics": (4.8017, 1e-3),  # with 15 harmonics
    "optimum_with_tolerance": (3.360, 3e-3),  # both ends of the tolerance equally high
    "own_matrices": (0.153249, 1e-5),  # det(K + k - w^2 M) = 0 by hand
    "phase_at_resonance": (-90.0, 0.01),  # a quarter of a period
    "residual_tractions": (4.48698e-4, 5e-4),  # published, as the lower one
    "results_as_tables": (1.0140, 1e-4),  # the optimum of `sweep_in_a_loop`
    "ring_of_masses": (RING, 1e-5),
    "ring_that_hits": (0.05648, 0.01),  # from event to event with saltation matrices
    "scaling_of_loads": (3.0, 1e-6),
    "static_contact": (0.3, 1e-6),  # springs in series
    "sweep_in_a_loop": (3.060, 1e-3),  # the loop, finer
    "time_integration_beside": (0.022, 0.2),  # DOP853, 15 harmonics
    "two_parameters": (1.0136, 1e-4),  # the stiffest slider, `sweep_in_a_loop`
    "uncertain_friction": (1.0284, 1e-3),
    "wear_of_a_face": (4.184686, 1e-5),  # coefficient times work over area
    "whole_run": (5.30, 0.01),  # the default blade with 20 um, draft
}


def last_number(printed: str) -> float:
    return float(re.findall(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", printed.splitlines()[-1].rpartition(": ")[2])[0])


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda script: script.stem)
def test_an_example_ends_with_a_known_number(script: Path, tmp_path: Path) -> None:
    pyplot.switch_backend("agg")
    number, tolerance = KNOWN[script.stem]
    printed = run_example(script, tmp_path)
    pyplot.close("all")
    assert last_number(printed) == pytest.approx(number, rel=tolerance)
    drawn = [path.name for path in tmp_path.glob("*.png")]
    assert drawn in ([], [f"{script.stem}.png"])
    assert all((DOCS / "images" / "examples" / name).is_file() for name in drawn), "python docs/execute.py --update"


def test_each_example_is_one_short_idea() -> None:
    assert len(EXAMPLES) == len(KNOWN) == 25
    assert all(12 <= len(script.read_text(encoding="utf-8").splitlines()) <= 42 for script in EXAMPLES)

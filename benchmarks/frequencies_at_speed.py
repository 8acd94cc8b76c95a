"""Natural frequencies at speed against CalculiX on the same meshes: the table of docs/developers/verification.md.

    python benchmarks/frequencies_at_speed.py --size 8

Three blades at three speeds, ten free modes each, largest relative differences: this program's nonlinear equilibrium
against a static step with NLGEOM, its linear one against a linear static step, each followed by *FREQUENCY with
PERTURBATION; then what three simplifications change: the linear equilibrium, leaving out the initial-displacement
stiffness too, leaving out the Coriolis forces. Needs CalculiX (`ccx`). Writes NAME.csv and NAME.md into
out/bench/NAME.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from tables import ROOT, markdown_table, options_of, write_results

sys.path.append(str(ROOT / "tests" / "rom"))

import calculix
from rom_reference import lowest_hz

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import FullModel, Material, ReductionOptions, assemble, natural_frequencies, reduce_sector
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.finite_elements.assembly import ElasticBody, stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.rotation import RotatingBody, centrifugal_displacement, stiffen_by_rotation

NAME = "frequencies_at_speed"
SPEEDS = (3000.0, 6000.0, 9000.0)  # rev/min
MODES = 10
STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
TITANIUM = Material(young_modulus=1.14e11, poisson_ratio=0.34, density=4430.0)
DEFAULT = BladeParameters(
    n_blades=72,
    hub_radius=0.3,
    length=0.15,
    chord=0.036,
    thickness=0.009,
    tip_thickness=0.006,
    twist=25.0,
    section="lens",
)
THIN = replace(DEFAULT, length=0.2, thickness=0.006, tip_thickness=0.003, twist=40.0, section="rectangle")
LONG = replace(DEFAULT, n_blades=60, hub_radius=0.35, length=0.25, thickness=0.01, twist=-30.0)
BLADES = {  # blade, shroud angle in degrees, material
    "default": (DEFAULT, 70.0, STEEL),
    "thin, twist 40": (THIN, 70.0, STEEL),
    "titanium, 250 mm, twist -30": (LONG, 140.0, TITANIUM),
}
COLUMNS = (
    "nonlinear, CalculiX",
    "linear, CalculiX",
    "linear equilibrium",
    "no initial displacement",
    "no Coriolis forces",
)


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, NAME)
    parser.add_argument("--size", type=float, default=8.0, help="mesh size, mm")
    parser.add_argument("--speeds", type=float, nargs="+", default=list(SPEEDS), help="rev/min")
    options = parser.parse_args(arguments)
    if calculix.PROGRAM is None:
        print("CalculiX is not installed: no ccx on PATH", file=sys.stderr)
        return 1
    rows = [row for blade in BLADES for row in measured(blade, options.size * 1e-3, options.speeds)]
    shown = [[f"{value:.1e}" if isinstance(value, float) else value for value in row.values()] for row in rows]
    write_results(options.out, NAME, rows, markdown_table(rows[0], shown) + "\n")
    return 0


def measured(name: str, size: float, speeds: list[float]) -> Iterator[dict[str, Any]]:
    """Rows of one blade."""
    parameters, angle, material = BLADES[name]
    shroud = ShroudParameters(angle=angle, thickness=0.005, axial_width=0.04, contact_length=0.012)
    sector = build_sector(parameters, shroud, MeshParameters(size=size))
    full = assemble(sector, material)
    mesh = calculix.quadratic_mesh(sector)

    def printed(omega: float, nonlinear: bool) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            return calculix.run(
                folder, calculix.deck(mesh, material, MODES, calculix.Rotation(omega, nonlinear=nonlinear))
            )

    for speed in speeds:
        omega = speed * np.pi / 30.0
        at_speed = {
            kind: stiffen_by_rotation(full, sector, material, speed, kind) for kind in ("nonlinear", "linear")
        }
        nonlinear, linear = (frequencies(model) for model in at_speed.values())
        rotating = RotatingBody.of(ElasticBody.of(discretise(sector, "hex20"), material), full)
        stress = stress_at_quadrature(
            rotating.body.discretisation, material, omega**2 * centrifugal_displacement(full)
        )
        plain = rotating.stiffness(np.zeros(full.n_dofs), omega**2, stress)
        model = reduce_sector(at_speed["nonlinear"], sector, ReductionOptions(modes=60)).model
        still, turning = natural_frequencies(model, 0.0), gyroscopic_frequencies(model, 0.0)
        differences = (
            (nonlinear, printed(omega, True)),
            (linear, printed(omega, False)),
            (linear, nonlinear),
            (lowest_hz(plain, full.mass, MODES, full.fixed), nonlinear),
            (still, turning),
        )
        values = {column: worst(*pair) for column, pair in zip(COLUMNS, differences, strict=True)}
        yield {"blade": name, "dofs": full.n_dofs, "rev/min": int(speed), **values}


def frequencies(full: FullModel) -> Any:
    """Lowest natural frequencies in Hz of a full model."""
    return lowest_hz(full.stiffness, full.mass, MODES, full.fixed)


def worst(found: Any, exact: Any) -> float:
    """Largest relative difference."""
    return float(np.max(np.abs(found / exact - 1.0)))


if __name__ == "__main__":
    sys.exit(main())

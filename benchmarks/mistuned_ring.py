"""Time a point of a mistuned ring against the number of blades, and ways to solve its linear system.

    python benchmarks/mistuned_ring.py                  # 12 to 144 blades, some minutes
    python benchmarks/mistuned_ring.py --blades 12 24
    python benchmarks/mistuned_ring.py --disk           # blades on the disk of scenes/disk.toml

The default blade with slipping contacts, one harmonic, an engine order of a quarter of the number of blades: so the
tuned ring is the same for every number of blades. Each number is measured in a process of its own; seconds are those
of the processor. Writes mistuned_ring.csv and mistuned_ring.md, or mistuned_disk.csv and mistuned_disk.md, into
out/bench/mistuned_ring.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from problems import built_mesh, curve_problem, scene_with
from tables import ROOT, in_a_process, machine_facts, options_of, peak_memory_gb, table_of, write_results

BLADES = (12, 24, 48, 72, 144)
INTERFERENCE, RANGE, DEVIATION = 2e-6, (256.0, 270.0), 0.01  # m, Hz: slip above the peak; of the frequencies
DISK, DISK_RANGE = ROOT / "scenes" / "disk.toml", (195.0, 215.0)  # Hz: the blades vibrate with free contacts
MOST_DENSE = 2500  # unknowns, above which the dense and the sparse factorisation take minutes


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "mistuned_ring")
    parser.add_argument(
        "--blades", type=int, nargs="+", default=list(BLADES), help="numbers of blades, multiples of 4"
    )
    parser.add_argument("--disk", action="store_true", help="blades on a disk, at their resonance with free contacts")
    options = parser.parse_args(arguments)
    source = DISK if options.disk else options.scene
    name = "mistuned_disk" if options.disk else "mistuned_ring"
    scene = scene_with(source, {"contact.interference": INTERFERENCE})
    rows = []
    with built_mesh(scene) as mesh:
        for blades in options.blades:
            rows.append(in_a_process("mistuned_ring", source, mesh.reduced().file, blades))
            print(f"{blades} blades: {rows[-1]['s a point']:.3g} s a point", file=sys.stderr)
    facts = "; ".join(f"{fact}: {text}" for fact, text in machine_facts().items())
    write_results(options.out, name, rows, f"# Mistuned rings\n\n{facts}.\n\n{table_of(rows)}\n")
    return 0


def measure(scene_file: str, model_file: str, blades: int) -> dict[str, Any]:
    """Processor seconds a point of a ring, of the ways to solve one bordered system, and memory (GB)."""
    import numpy as np

    from nonlinear.mistuned_ring.linear_contacts import strain_directions
    from nonlinear.mistuned_ring.mistuning import Mistuning
    from nonlinear.mistuned_ring.ring_balance import RingBalance
    from nonlinear.mistuned_ring.ring_receptance import RingReceptance
    from nonlinear.mistuned_ring.ring_response import mistuned_response
    from nonlinear.mistuned_ring.sector_ring import SectorRing
    from rom.cyclic.receptance import RelativeReceptance
    from rom.linear_algebra.threads import one_blas_thread

    scene = scene_with(scene_file, {"contact.interference": INTERFERENCE})
    problem = curve_problem(model_file, scene)
    excitation = replace(problem.excitation, engine_order=blades // 4)
    if clamped := not problem.modal.joined:
        modal = replace(problem.modal, n_blades=blades)
    else:  # the same waves, at other phases
        modal = replace(problem.modal, model=replace(problem.modal.model, n_blades=blades))
    options = replace(problem.options, frequency_hz=RANGE if clamped else DISK_RANGE, harmonics=1)
    mistuning = Mistuning.sampled(blades, 1, frequency=DEVIATION)
    with one_blas_thread():
        mistuned_response(modal, problem.contact, excitation, options)  # compiles the kernels
        start = time.process_time()
        found = mistuned_response(modal, problem.contact, excitation, options, mistuning)
        seconds = time.process_time() - start
        receptance = RelativeReceptance(modal, modal.phase(excitation.engine_order), (0, 1), excitation.force)
        structure: RingReceptance | SectorRing
        if clamped:
            structure = RingReceptance(receptance, 1.0 + mistuning.frequency)
        else:
            strain = strain_directions(receptance, problem.contact, options.omega_range[1])
            structure = SectorRing(receptance, blades, strain)
        balance = RingBalance.of(structure, problem.contact, mistuning, options)
        rng = np.random.default_rng(0)
        unknown = 5e-6 * rng.standard_normal(balance.size)
        vectors, omega = rng.standard_normal((3, balance.size)), 2.0 * np.pi * sum(options.frequency_hz) / 2.0
        ways = (ways_to_solve if clamped else with_a_disk)(balance, unknown, omega, vectors)
    return {
        "blades": blades,
        "unknowns": balance.size,
        "points": found.frequency_hz.size,
        "s a point": round(seconds / max(found.frequency_hz.size, 1), 4),
        "evaluations a point": round(1.0 + float(found.iterations.mean()), 1),
        **ways,
        "memory GB": round(peak_memory_gb(), 2),
    }


def ways_to_solve(balance: Any, unknown: Any, omega: float, vectors: Any) -> dict[str, Any]:
    """Processor seconds of assembly and of the ways to solve a bordered system at one state; GMRES iterations."""
    import numpy as np
    from scipy.linalg import lu_factor, lu_solve
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    from nonlinear.mistuned_ring.mistuned_structure import by_pair

    column, row, right = vectors
    seconds: dict[str, Any] = {}
    linearised = balance.evaluate(unknown, omega)
    structure, system = balance.structure, linearised.system(column, row, 1.0)
    blocks = timed(seconds, "assembly s", lambda: structure.jacobian_blocks(omega, system.change))
    exact = timed(seconds, "block elimination s", lambda: linearised.factorise(column, row, 1.0).solve(right, 0.5))
    rows = 2 * balance.n_harmonics + 1
    sides = [by_pair(vector, rows, balance.n_blades) for vector in vectors]
    circulant = timed(seconds, "GMRES, circulant s", lambda: circulant_gmres(blocks, *sides))
    seconds["GMRES iterations"] = circulant[1]
    assert np.isfinite(exact[0]).all()
    for name in ("dense s", "sparse s"):
        seconds[name] = "-"
    if balance.size <= MOST_DENSE:
        whole = linearised.jacobian
        bordered = np.block([[whole, column[:, None]], [row[None], np.ones((1, 1))]])
        full = np.append(right, 0.5)
        solved = timed(seconds, "dense s", lambda: lu_solve(lu_factor(bordered), full))
        assert np.abs(solved[:-1] - exact[0]).max() < 1e-8 * np.abs(solved).max()
        sparse = csc_array(bordered)
        timed(seconds, "sparse s", lambda: splu(sparse).solve(full))
    return seconds


def with_a_disk(balance: Any, unknown: Any, omega: float, vectors: Any) -> dict[str, Any]:
    """Processor seconds of the factors and of a solution by GMRES at one state, and of a dense solution."""
    import numpy as np

    from nonlinear.harmonic_balance.condensed_factors import DenseFactors
    from nonlinear.mistuned_ring.sector_ring import SectorFactors

    column, row, right = vectors
    seconds: dict[str, Any] = {}
    linearised = balance.evaluate(unknown, omega)
    system = linearised.system(column, row, 1.0)
    factors = SectorFactors(balance.structure, system)
    near = timed(seconds, "factors s", lambda: factors.near)
    seconds["modes in the border"] = near.strain.shape[2] // 2
    found = timed(seconds, "GMRES s", lambda: factors.solve(right, 0.5))
    seconds["dense s"] = "-"
    if balance.size <= MOST_DENSE:
        dense = timed(
            seconds,
            "dense s",
            lambda: DenseFactors.of(balance.structure.coupling(omega, system.change), column, row, 1.0),
        )
        exact = dense.solve(right, 0.5)[0]
        assert np.abs(exact - found[0]).max() < 1e-5 * np.abs(exact).max()
    return seconds


def circulant_gmres(blocks: Any, column: Any, row: Any, right: Any) -> tuple[Any, int]:
    """GMRES on the ring with the mean blocks as block-circulant preconditioner: solution and iterations.

    The border is eliminated with two solutions, as the preconditioner has none: one for each right-hand side.
    """
    import numpy as np
    from scipy.sparse.linalg import LinearOperator, gmres

    count, size = right.shape
    turn = np.exp(2j * np.pi * np.arange(count) / count)[:, None, None]
    before, own, after = (part.mean(axis=0) for part in blocks)
    inverse = np.linalg.inv(own + before / turn + after * turn)
    iterations = 0

    def precondition(x: Any) -> Any:
        waves = np.fft.fft(x.reshape(count, size), axis=0)
        return np.fft.ifft((inverse @ waves[..., None])[..., 0], axis=0).real.reshape(-1)

    def product(x: Any) -> Any:
        return blocks.times(x.reshape(count, size, 1)).reshape(-1)

    def count_one(_: Any) -> None:
        nonlocal iterations
        iterations += 1

    shape = (count * size, count * size)
    matrix, preconditioner = LinearOperator(shape, product), LinearOperator(shape, precondition)
    settings: dict[str, Any] = {"M": preconditioner, "rtol": 1e-10, "restart": 200, "maxiter": 5}
    found = [
        gmres(matrix, side.reshape(-1), callback=count_one, callback_type="pr_norm", **settings)[0]
        for side in (right, column)
    ]
    z = (0.5 - row.reshape(-1) @ found[0]) / (1.0 - row.reshape(-1) @ found[1])
    return found[0] - z * found[1], iterations


def timed(seconds: dict[str, Any], name: str, call: Callable[[], Any]) -> Any:
    """The value of a call; its processor seconds under a name."""
    start = time.process_time()
    value = call()
    seconds[name] = round(time.process_time() - start, 4)
    return value


if __name__ == "__main__":
    sys.exit(main())

"""The same parameters give the same mesh, bit for bit, whatever happened before; and gmsh leaves no trace."""

import hashlib
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from geometry_support import FIGURE, SLENDER, figure_shroud, slender_shroud

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector

# an odd one, for which only the unstructured layout is good, and the usual ones
CONTORTED = (
    BladeParameters(90, 0.60, 0.20, 0.0085, 0.0014, twist=-28.0),
    ShroudParameters(49.0, 0.0245, 0.087, 0.050),
    MeshParameters(0.008, (5, 2)),
)
CASES = {
    "figure": (FIGURE, figure_shroud(70.0), MeshParameters(0.005)),
    "slender": (SLENDER, slender_shroud(120.0), MeshParameters(0.004)),
    "contorted": CONTORTED,
}


def digest(mesh):
    """Of every number in the mesh."""
    arrays = [mesh.points, mesh.hexahedra, *(nodes for _, nodes in sorted(mesh.node_sets.items()))]
    for face in (mesh.right, mesh.left):
        arrays += [face.nodes, face.position, face.frame, face.area]
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


@pytest.mark.parametrize("name", CASES)
def test_repeats_in_one_process_whatever_was_built_between(name):
    first = digest(build_sector(*CASES[name]))
    for other in CASES.values():
        build_sector(*other)
    assert digest(build_sector(*CASES[name])) == first


def test_the_contorted_case_is_unstructured():
    """Otherwise these tests would not see the mesher that has random numbers."""
    from geometry.blade.fitting import fitted_planform
    from geometry.blade.planform_mesh import _best_halves

    blade, shroud, mesh = CONTORTED
    (layout, _), _ = _best_halves(fitted_planform(blade, shroud), mesh.size, mesh.contact_grid[0])
    assert layout.free


def test_repeats_in_other_processes():
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]);"
        "from test_determinism import CASES, digest; from geometry import build_sector;"
        "print(*(digest(build_sector(*case)) for case in CASES.values()))"
    )
    here = __file__.rsplit("/", 1)[0]
    expected = [digest(build_sector(*case)) for case in CASES.values()]
    for seed in ("0", "12345"):
        command = [sys.executable, "-c", program, here]
        run = subprocess.run(command, env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True)
        assert run.stdout.split() == expected
        assert run.stderr == ""


def test_signals_are_left_as_they_were():
    """gmsh resets SIGTERM, SIGHUP and SIGPIPE to what ends the process, which Python does not see."""

    def caught() -> list[str]:
        return [
            line for line in open("/proc/self/status").read().splitlines() if line.startswith(("SigIgn", "SigCgt"))
        ]

    before = {number: signal.signal(number, lambda *_: None) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        build_sector(*CASES["figure"])  # loads gmsh, whose libraries may use a signal of their own
        expected = caught()
        build_sector(*CASES["figure"])
        assert caught() == expected
        mask = int(expected[1].split()[1], 16)
        assert all(mask >> (number - 1) & 1 for number in before)
        assert int(expected[0].split()[1], 16) >> (signal.SIGPIPE - 1) & 1
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_works_in_a_thread():
    """gmsh would install a signal handler, which only the main thread may."""
    expected = digest(build_sector(*CASES["figure"]))
    with ThreadPoolExecutor(1) as pool:
        assert digest(pool.submit(build_sector, *CASES["figure"]).result()) == expected


def test_is_quiet_and_closes_gmsh(capfd):
    import gmsh

    for case in CASES.values():
        build_sector(*case)
    captured = capfd.readouterr()
    assert captured.out == ""
    assert captured.err == ""
    assert not gmsh.isInitialized()


def test_leaves_a_callers_gmsh_session_as_it_was():
    import gmsh

    from geometry.gmsh_start import start_gmsh

    expected = digest(build_sector(*CASES["contorted"]))
    start_gmsh(gmsh)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 5)
        gmsh.model.add("theirs")
        point = gmsh.model.geo.addPoint(1.0, 2.0, 3.0)
        gmsh.model.geo.synchronize()
        assert digest(build_sector(*CASES["contorted"])) == expected
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "theirs"
        assert gmsh.model.getEntities(0) == [(0, point)]
        assert gmsh.option.getNumber("Mesh.Algorithm") == 5
    finally:
        gmsh.finalize()


def test_import_costs_nothing_heavy():
    heavy = "gmsh, meshio, h5py, pyvista, vtk, matplotlib, numba, skfem, scipy"
    program = f"import sys, geometry; print([name for name in '{heavy}'.split(', ') if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"

"""The peers' problem solved and timed by one program in a process of its own: `python peers_programs.py REQUEST`.

REQUEST is a `Request` as JSON; the answer is the last line printed, JSON too (`Answer`). The file runs in the
project's environment (program "shroud") and in that of the peer ("pyHarm"); it imports neither before it is asked to.

The peers' problem: 12 nodes of 3 dofs (x, y tangential, z normal) in a row, M = I, K = kron(T T, A) / lam^2,
C = 0.004 K, nodes 4 to 12 against ground, a force 2 cos(w t) in x on node 12, w from 0.5 to 1.6.

* A: friction of constant limit 0.30 + 0.05 i (i = 0 .. 8), kt = 0.4.
* V: normal load N0 - kn z about a preload in equilibrium (1.6, 1.2 and 1.0, three nodes each), kn = 0.8, kt = 0.4,
  mu = 0.5; and a force cos(w t) in z on node 12. No node lifts off.

Problem S is of the size of a shrouded blade: matrices, contacts and force come from a file (`peers_blade.py`).
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIRST_STEP = 0.35  # largest step of pyHarm at the first curve
LEAST_CURVES = 3
TANGENTIAL, NORMAL, FRICTION = 0.4, 0.8, 0.5
LIMITS = np.asarray(0.30 + 0.05 * np.arange(9), dtype=np.float64)
PRELOADS = np.repeat(np.array([1.6, 1.2, 1.0]), 3)


@dataclass(frozen=True)
class Request:
    """What to solve, and how often.

    Attributes
    ----------
    program, variant : str
        "shroud" with "exact" or "sampled", "pyHarm" with a key of `PYHARM_VARIANTS`.
    kind, harmonics : str, int
        Problem A, V or S, and H.
    tolerance : float
        Of Newton's method.
    samples : int
        Samples per period of the sampled elements.
    curves, seconds : int, float
        Curves timed after the first; no more once `seconds` are spent and three are done.
    points : int
        Points per curve that the step of pyHarm is fitted to (0: no fit).
    frequencies : tuple of float
        omega at which the response is wanted.
    curve : bool
        False to solve at these frequencies only.
    file : str
        Matrices of problem S, NPZ.
    """

    program: str
    variant: str
    kind: str
    harmonics: int
    tolerance: float
    samples: int = 128
    curves: int = 0
    seconds: float = 30.0
    points: int = 0
    frequencies: tuple[float, ...] = ()
    curve: bool = True
    file: str = ""


@dataclass(frozen=True)
class Problem:
    """What both programs are given. Nodes have 3 dofs: x and y tangential, z normal, away from the ground.

    Attributes
    ----------
    mass, stiffness : (n, n)
        M and K.
    damping : float
        C = damping K.
    contacts : (n_c,) int
        Nodes against ground.
    forces : list of (int, int, float)
        Node, dof, amplitude of the cosine.
    output : (int, int)
        Node and dof whose first harmonic is compared.
    normal, tangential, friction, load : (n_c,)
        kn, kt, mu and N0 of the contacts; kn is 0 where the normal load is constant.
    span : (float, float)
        First and last omega.
    """

    mass: Array
    stiffness: Array
    damping: float
    contacts: NDArray[np.int64]
    forces: list[tuple[int, int, float]]
    output: tuple[int, int]
    normal: Array
    tangential: Array
    friction: Array
    load: Array
    span: tuple[float, float]


class Seconds(NamedTuple):
    """How long something took: on the clock, and of the processor."""

    wall: float
    cpu: float

    @staticmethod
    def now() -> Seconds:
        """A moment, to take the time from."""
        return Seconds(time.perf_counter(), time.process_time())

    def passed(self) -> Seconds:
        """The time since this moment."""
        now = Seconds.now()
        return Seconds(now.wall - self.wall, now.cpu - self.cpu)


@dataclass(frozen=True)
class Curve:
    """A solved curve: points and Newton iterations, whether it covers the range, and its highest point."""

    points: int
    iterations: int | None
    complete: bool
    peak_frequency: float
    peak: float


@dataclass(frozen=True)
class Answer:
    """Time of the import, of the first curve (None if there is none) and of the timed ones; the last curve.

    `response` is |q^(1)| of the output at the frequencies of the request; `versions` those of the libraries.
    """

    imported: Seconds
    first: Seconds | None
    first_points: int
    timed: list[Seconds]
    curve: Curve | None
    response: list[float]
    versions: dict[str, str]


@dataclass(frozen=True)
class Program:
    """A program with the problem before it.

    `prepare(step)` sets one curve up, not timed, and returns the call that solves it; `at(w)` is |q^(1)| there.
    """

    imported: Seconds
    prepare: Callable[[float], Callable[[], Curve]]
    at: Callable[[float], float]
    libraries: tuple[str, ...]


def stiffness() -> Array:
    """K (36, 36)."""
    chain = 2.0 * np.eye(12) - np.eye(12, k=1) - np.eye(12, k=-1)
    chain[11, 11] = 1.0
    coupling = np.array([[1.0, 0.0, 0.3], [0.0, 2.0, 0.0], [0.3, 0.0, 4.0]])
    return np.kron(chain @ chain, coupling) / (4.0 * np.sin(np.pi / 50.0) ** 2) ** 2


def problem(request: Request) -> Problem:
    """The problem of a request."""
    every = np.ones(9)
    if request.kind == "S":
        with np.load(request.file) as file:
            forces = [(int(node), int(dof), float(amplitude)) for node, dof, amplitude in file["forces"]]
            output, span = (tuple(file[name].tolist()) for name in ("output", "span"))
            names = ("normal", "tangential", "friction", "load")
            laws = {name: np.asarray(file[name]) for name in names}
            matrices = file["mass"], file["stiffness"], float(file["damping"])
            return Problem(*matrices, file["contacts"], forces, output, span=span, **laws)
    forces = [(11, 0, 2.0)] + [(11, 2, 1.0)] * (request.kind == "V")
    row = np.eye(36), stiffness(), 0.004, np.arange(3, 12), forces, (11, 0)
    if request.kind == "A":
        return Problem(*row, 0 * every, TANGENTIAL * every, every, LIMITS, (0.5, 1.6))
    return Problem(*row, NORMAL * every, TANGENTIAL * every, FRICTION * every, PRELOADS, (0.5, 1.6))


def shroud(request: Request) -> Program:
    """The problem as this project takes it: relative coordinates, normal direction -z."""
    given = problem(request)
    began = Seconds.now()
    from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
    from rom import ReducedModel, modal_model

    imported = began.passed()
    size, count = len(given.mass), len(given.contacts)
    right = np.zeros((3 * count, size))
    for contact, node in enumerate(given.contacts):
        right[3 * contact + np.arange(3), 3 * node + np.arange(3)] = [1.0, 1.0, -1.0]
    force, output = np.zeros(size), np.zeros(size)
    for node, dof, amplitude in given.forces:
        force[3 * node + dof] = amplitude
    output[3 * given.output[0] + given.output[1]] = 1.0
    model = ReducedModel(given.mass, given.stiffness, right, np.zeros((count, 3)), force, {"tip": output})
    modal = modal_model(model, rayleigh=(0.0, given.damping))
    parameters = ContactParameters(given.normal, given.tangential, given.friction, np.zeros(count), given.load)

    def solve(low: float, high: float, max_points: int = 5000) -> Any:
        options = SolverOptions(
            (low / (2.0 * np.pi), high / (2.0 * np.pi)),
            harmonics=request.harmonics,
            samples=request.samples,
            integration="exact" if request.variant == "exact" else "sampled",
            detached=False,  # pyHarm looks for no other branches,
            stability="folds",  # says nothing of the stability
            truncation=False,  # and does not tell what the harmonics left out would change
            tolerance=request.tolerance,
            round_off=max(request.tolerance, 1e-12),
            max_points=max_points,
        )
        return forced_response(modal, parameters, Excitation(0, 1.0), options)

    def whole() -> Curve:
        curve = solve(*given.span)
        top = int(np.argmax(curve.harmonic_m[:, 0]))
        return Curve(
            points=curve.points,
            iterations=int(curve.iterations.sum()),
            complete=curve.termination.complete,
            peak_frequency=float(2.0 * np.pi * curve.frequency_hz[top]),
            peak=float(curve.harmonic_m[top, 0]),
        )

    def at(frequency: float) -> float:
        first_point = solve(frequency, 1.01 * frequency, max_points=1)
        return float(first_point.harmonic_m[0, 0])

    return Program(imported, lambda step: whole, at, ("numpy", "scipy", "numba"))


# Solver and contact directions. Nothing moves along y here: one slider along x gives the same response as two.
PYHARM_VARIANTS: dict[str, tuple[str, list[int]]] = {
    "Jenkins x": ("NewtonRaphson", [0]),
    "Jenkins x, y": ("NewtonRaphson", [0, 1]),
    "Penalty3D": ("NewtonRaphson", [2, 0, 1]),
    "Penalty3D, hybrid": ("scipyroot", [2, 0, 1]),
}


def pyharm_input(request: Request, step: float) -> dict[str, Any]:
    """The problem as pyHarm takes it: tangent predictor, pseudo-arc-length, all dofs.

    Of its options these were the fastest that reach the end of the range: its reduction to the nonlinear dofs makes a
    curve slower by a fifth, its Moore-Penrose corrector stalls near the peak, its JAX Jacobian of the Jenkins element
    is half again as slow as the analytic one. Penalty3D has a JAX Jacobian only.
    """
    given, (solver, directions) = problem(request), PYHARM_VARIANTS[request.variant]
    connectors: dict[str, Any] = {
        f"force_{dof}": {"type": "CosinusForcing", "connect": {"row": [node]}, "dirs": [dof], "amp": amplitude}
        for node, dof, amplitude in given.forces
    }
    for contact, node in enumerate(given.contacts.tolist()):
        element: dict[str, Any] = {"connect": {"row": [node]}, "dirs": directions}
        element |= {"mu": float(given.friction[contact]), "N0": float(given.load[contact])}
        if request.kind == "A":
            element |= {"type": "Jenkins", "k": float(given.tangential[contact])}
        else:
            stiffnesses = {"k_n": float(given.normal[contact]), "k_t": float(given.tangential[contact])}
            element |= {"type": "Penalty3D", "g": 0.0, **stiffnesses}
        connectors[f"contact_{contact}"] = element
    tolerance = request.tolerance
    newton = {"tol_residual": tolerance, "tol_delta_x": tolerance, "max_iter": 30}
    hybrid = {"root": {"method": "hybr", "options": {"xtol": tolerance}}}
    analysis = {
        "study": "frf",
        "puls_inf": given.span[0],
        "puls_sup": given.span[1],
        "corrector": "pseudo_arc_length",
        "solver": solver,
        "solver_options": newton if solver == "NewtonRaphson" else hybrid,
        "ds0": 0.05,
        "ds_max": step,
        "stopper": "solnumber",
        "stopper_options": {"max_solutions": 2000},
        "verbose": False,
    }
    matrices = {"M": given.mass, "C": given.damping * given.stiffness, "K": given.stiffness}
    return {
        "system": {"type": "Base", "nh": request.harmonics, "nti": request.samples},
        "substructures": {"row": {"matrix": matrices, "ndofs": 3}},
        "connectors": connectors,
        "analysis": {"curve": analysis},
    }


def pyharm(request: Request) -> Program:
    """The problem in pyHarm; a point is an accepted solution inside the range."""
    began = Seconds.now()
    import logging

    from pyHarm import Maestro

    imported = began.passed()
    logging.disable(logging.CRITICAL)
    given = problem(request)
    low, high = given.span
    last: list[Any] = []

    def accepted() -> list[Any]:
        return [s for s in last[-1].nls["curve"].SolList if s.flag_accepted and low <= s.x[-1] <= high]

    def amplitude(unknown: Array) -> float:
        dofs = last[-1].system.expl_dofs
        node, dof = given.output
        chosen = (dofs["node_num"] == node) & (dofs["dof_num"] == dof) & (dofs["harm"] == 1)
        return float(np.linalg.norm(unknown[np.flatnonzero(chosen)]))

    def solve() -> Curve:
        last[-1].operate()
        everything, points = last[-1].nls["curve"].SolList, accepted()
        heights = [amplitude(point.x) for point in points]
        top = int(np.argmax(heights))
        counted = all(hasattr(s, "iter_numb") for s in everything)
        return Curve(
            points=len(points),
            iterations=sum(s.iter_numb for s in everything) if counted else None,
            complete=bool(everything[-1].flag_accepted and everything[-1].x[-1] >= high),
            peak_frequency=float(points[top].x[-1]),
            peak=heights[top],
        )

    def prepare(step: float) -> Callable[[], Curve]:
        last[:] = [Maestro(pyharm_input(request, step))]
        return solve

    def at(frequency: float) -> float:
        """Newton's method on the equations of pyHarm from the nearest point of its last curve, one step for good."""
        system = last[-1].system
        nearest = min(accepted(), key=lambda point: abs(point.x[-1] - frequency))
        unknown = np.append(nearest.x[:-1], frequency)
        for _ in range(30):
            residual = np.asarray(system.Residual(unknown))
            unknown[:-1] -= np.linalg.solve(np.asarray(system.Jacobian(unknown)[0]), residual)
            if np.linalg.norm(residual) < request.tolerance:
                return amplitude(unknown)
        return float("nan")

    return Program(imported, prepare, at, ("pyHarm-os", "numpy", "scipy", "numba", "jax"))


def timed(call: Callable[[], Curve]) -> tuple[Curve, Seconds]:
    """The curve, and how long it took."""
    began = Seconds.now()
    curve = call()
    return curve, began.passed()


def answer(request: Request) -> Answer:
    """Solve what is asked for. The first curve, which compiles, is not among the timed ones."""
    program = {"shroud": shroud, "pyHarm": pyharm}[request.program](request)
    step, first_points = FIRST_STEP, 0
    curve: Curve | None = None
    first: Seconds | None = None
    times: list[Seconds] = []
    if request.curve:
        curve, first = timed(program.prepare(step))
        first_points = curve.points
        if request.points:
            step *= curve.points / request.points
    while len(times) < request.curves and (
        len(times) < LEAST_CURVES or sum(seconds.wall for seconds in times) < request.seconds
    ):
        curve, seconds = timed(program.prepare(step))
        times.append(seconds)
    response = [program.at(frequency) for frequency in request.frequencies]
    versions = {name: version(name) for name in program.libraries}
    return Answer(program.imported, first, first_points, times, curve, response, versions)


if __name__ == "__main__":
    print(json.dumps(asdict(answer(Request(**json.loads(sys.argv[1]))))))

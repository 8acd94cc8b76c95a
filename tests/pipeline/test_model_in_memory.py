"""`run_scene(rom=ReducedModel.from_matrices(...))`: a model of the user's own arrays, without a file."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pipeline_support import statuses
from scipy.optimize import fsolve
from scipy.sparse import csr_array

import shroud

M, K = np.diag([1.0, 0.5]), np.array([[1.5, -0.5], [-0.5, 0.5]])
ROWS = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])  # the second mass rubs along t1
B, KT, FORCE, SLIP = 0.02, 0.4, 1.0, 0.15  # C = b K; slider: stiffness, N; friction force, N
MODEL = shroud.ReducedModel.from_matrices(M, K, ROWS, load=[1.0, 0.0], output=[0.0, 1.0])


def run(out: Path, model: Any = MODEL, preload: float = 1.0, **response: Any) -> Any:
    contact = {"normal_stiffness": 0.0, "tangential_stiffness": KT, "friction": SLIP, "preload": preload}
    asked = {"frequency": [0.05, 0.35], "rayleigh": [0.0, B], "harmonics": 1, "truncation": False, **response}
    excitation = {"engine_order": 0, "force": FORCE}
    return shroud.run_scene(
        out=out, rom=model, contact=contact, excitation=excitation, response=asked, until="respond"
    )


def receptance(omega: float, spring: complex = 0.0) -> np.ndarray:
    """Amplitudes of both masses with C = b K and a spring between the second one and the ground."""
    dynamic = K * (1.0 + 1j * omega * B) - omega**2 * M + spring * np.outer(ROWS[0], ROWS[0])
    return np.linalg.solve(dynamic, FORCE * np.array([1.0, 0.0]))


def jenkins(amplitude: float) -> complex:
    """Stiffness of a Jenkins element in the first harmonic, by its textbook describing function."""
    share = SLIP / KT / amplitude
    if share >= 1.0:
        return KT
    angle = np.arccos(1.0 - 2.0 * share)
    return complex(KT / np.pi * (angle - np.sin(2.0 * angle) / 2.0), 4.0 * KT / np.pi * share * (1.0 - share))


def test_its_curve_is_the_harmonic_balance_of_the_describing_function(tmp_path: Path) -> None:
    curve = run(tmp_path / "out").curves[0]
    slipping = np.flatnonzero(curve.amplitude_m > SLIP / KT)
    assert slipping.size > 20
    for point in slipping[:: max(slipping.size // 12, 1)]:
        omega, found = 2.0 * np.pi * curve.frequency_hz[point], curve.amplitude_m[point]

        def off(x: np.ndarray, omega: float = omega) -> float:
            return abs(receptance(omega, jenkins(abs(x[0])))[1]) - x[0]

        assert found == pytest.approx(fsolve(off, found * 1.001, xtol=1e-13)[0], rel=1e-8)


@pytest.mark.parametrize(("preload", "spring"), [(0.0, 0.0), (1e4, KT)])
def test_free_and_stuck_it_is_the_linear_receptance(tmp_path: Path, preload: float, spring: float) -> None:
    curve = run(tmp_path / "out", preload=preload).curves[0]
    exact = [abs(receptance(2.0 * np.pi * frequency, spring)[1]) for frequency in curve.frequency_hz]
    assert curve.amplitude_m == pytest.approx(exact, rel=1e-9)


def test_curves_are_cached_by_the_content_of_the_arrays(tmp_path: Path) -> None:
    first = run(tmp_path / "out")
    same = shroud.ReducedModel.from_matrices(csr_array(M), K.tolist(), ROWS.astype(int), [1, 0], {"tip": [0, 1]})
    again = run(tmp_path / "out", same)
    assert statuses(tmp_path / "out")["respond"] == "reused"
    assert np.array_equal(first.curves[0].amplitude_m, again.curves[0].amplitude_m)
    stiffer = shroud.ReducedModel.from_matrices(M, 1.01 * K, ROWS, [1.0, 0.0], [0.0, 1.0])
    run(tmp_path / "out", stiffer)
    assert statuses(tmp_path / "out")["respond"] == "ran"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mass": np.ones(2)}, "mass: shape (2,), allowed: one coordinate or more"),
        ({"mass": np.eye(3)}, "stiffness: shape (2, 2), allowed: (3, 3)"),
        ({"stiffness": [[1.0, 2.0], [0.0, 1.0]]}, "stiffness: asymmetric by 1 of its largest entry, allowed: 1e-08"),
        ({"stiffness": [[1.0], [1.0, 2.0]]}, "stiffness: not an array of numbers, allowed: rows of equal length"),
        ({"contact_right": ROWS[:2]}, "contact_right: shape (2, 2), allowed: three rows, along t1, t2, n, for"),
        ({"contact_left": ROWS[:, :1]}, "contact/left: shape (3, 1), allowed: (3, 2)"),
        ({"load": [1.0]}, "force/excitation: shape (1,), allowed: (2,)"),
        ({"load": [1.0, 1j], "output": None}, "output: missing, allowed: a row of the displacement, as the load"),
        ({"output": [1.0, np.nan]}, "output/tip: holds values that are not finite"),
        ({"n_blade": 4}, "n_blade: unknown attribute, allowed: those of ReducedModel"),
    ],
)
def test_what_is_wrong_is_named(changes: dict[str, Any], said: str) -> None:
    arguments = {"mass": M, "stiffness": K, "contact_right": ROWS, "load": [1.0, 0.0], "output": [0.0, 1.0]}
    with pytest.raises(shroud.ReducedModelError, match=f"^{re.escape(said)}"):
        shroud.ReducedModel.from_matrices(**{**arguments, **changes})


def test_what_is_wrong_in_a_run_is_named(tmp_path: Path) -> None:
    floating = shroud.ReducedModel.from_matrices(-M, K, ROWS, [1.0, 0.0])
    with pytest.raises(shroud.InputError, match=r"^scene on rom: mass"):
        run(tmp_path / "out", floating)
    none = shroud.ReducedModel.from_matrices(M, K, np.zeros((0, 2)), [1.0, 0.0])
    with pytest.raises(shroud.InputError, match=r"^rom: contact/right: no contact nodes"):
        run(tmp_path / "out", none)
    with pytest.raises(TypeError, match="needs a scene, or rom"):
        shroud.run_scene(contact={"friction": 0.1})

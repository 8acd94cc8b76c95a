"""The claims of the paper about its figures 5, 6 and 7, asserted on the curves of the shipped scenes.

Gulisano, Firrone, Zucca: Forced response of shrouded blades with a coupled static/dynamic approach (ENOC 2011).
"""

import tomllib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.cli import command
from rom import linear_response, modal_model, natural_frequencies, read_reduced_model

# one worker solves the scenes once for all of these
pytestmark = pytest.mark.xdist_group("paper")

SCENES = Path(__file__).parents[1] / "scenes"
MAIN_BRANCHES = 'stability = "wave"\ndetached = false\ntruncation = false\nsearch = "off"\n'
OWN_KEYS = {"name", "title", "sweep"}


@dataclass(frozen=True)
class Curve:
    """One solved curve; folds are the frequencies, Hz, at which it turns around, in the order of the arc."""

    v0: float
    engine_order: int
    frequency: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    stable: NDArray[np.bool_]

    @property
    def peak(self) -> tuple[float, float]:
        top = int(np.argmax(self.amplitude))
        return float(self.frequency[top]), float(self.amplitude[top])

    @property
    def folds(self) -> list[float]:
        direction = np.sign(np.diff(self.frequency))
        turns = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
        return [float(self.frequency[turn]) for turn in turns]

    @property
    def unstable_stretches(self) -> int:
        return int(np.count_nonzero(np.diff(self.stable.astype(int)) == -1))


@dataclass(frozen=True)
class Figure:
    """The curves of a scene with its linear limits: natural frequency, Hz, and height of the resonance, m."""

    curves: list[Curve]
    free: tuple[float, float]
    stuck: tuple[float, float]


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Figure]:
    return {number: run(number, tmp_path_factory.mktemp(f"figure{number}")) for number in (5, 6, 7)}


def run(number: int, out: Path) -> Figure:
    """Solve a shipped scene on a coarse mesh, the main branches alone as the paper does, and read what it wrote."""
    shipped = (SCENES / f"figure{number}.toml").read_text()
    assert shipped.count("[response]\n") == 1
    scene = out / "scene.toml"
    coarse = shipped.replace("size = 0.004 ", "size = 0.009 ").replace("modes = 30", "modes = 8")
    scene.write_text(coarse.replace("[response]\n", f"[response]\n{MAIN_BRANCHES}"))
    assert command(["run", str(scene), "--out", str(out / "out"), "--until", "respond", "--quiet"]) == 0
    out = out / "out"
    with h5py.File(out / "response.h5") as file:
        groups = [file["curve"][name] for name in sorted(file["curve"], key=int)]
        curves = [
            Curve(
                float(group.attrs["contact.interference"]),
                int(group.attrs["excitation.engine_order"]),
                group["frequency_hz"][()],
                group["amplitude_m"][()],
                group["stable"][()].astype(bool),
            )
            for group in groups
        ]
        assert all(group.attrs["complete"] for group in groups)
        assert all(group["energy_error"][()].max() < 1e-8 for group in groups)
    rom = next((out / "store" / "reduce").glob("*/rom.h5"))
    return Figure(curves, limit(number, rom, stuck=False), limit(number, rom, stuck=True))


def limit(number: int, rom: Path, stuck: bool) -> tuple[float, float]:
    """Natural frequency and height of the first resonance with the contacts free, or stuck in opposition."""
    scene = load(number)
    model = read_reduced_model(rom)
    assert model.contact_area is not None
    share = stuck * model.contact_area / model.contact_area.sum()
    springs = {
        "normal": scene["contact"]["normal_stiffness"] * share,
        "tangential": scene["contact"]["tangential_stiffness"] * share,
    }
    half = scene["blade"]["n_blades"] // 2
    hertz = float(natural_frequencies(model, np.pi, count=1, **springs)[0])
    modal = modal_model(model, damping_ratio=scene["response"]["damping_ratio"])
    near = hertz * np.linspace(0.999, 1.001, 2001)
    force = scene["excitation"]["force"]
    response = linear_response(modal, near, phase=modal.phase(half), force=force, **springs)
    return hertz, float(np.abs(response).max())


def load(number: int) -> dict[str, Any]:
    return tomllib.loads((SCENES / f"figure{number}.toml").read_text())


def test_one_blade_and_one_set_of_parameters() -> None:
    """Only the shroud angle, the interference and the engine order differ (and the range that is drawn)."""
    common = []
    for number in (5, 6, 7):
        scene = {key: value for key, value in load(number).items() if key not in OWN_KEYS}
        scene["shroud"].pop("angle")
        scene["contact"].pop("interference", None)
        scene["excitation"].pop("engine_order", None)
        scene["response"].pop("frequency")
        common.append(scene)
    assert common[0] == common[1] == common[2]
    assert [load(number)["shroud"]["angle"] for number in (5, 6, 7)] == [70.0, 180.0, 180.0]
    assert load(5)["sweep"].keys() == load(6)["sweep"].keys() == {"contact.interference"}
    assert load(7)["sweep"].keys() == {"excitation.engine_order"}
    assert common[0]["response"]["harmonics"] == 1
    assert common[0]["mesh"]["contact_grid"] == [3, 3]


def test_unstable_branches_lie_between_turning_points(figures: dict[int, Figure]) -> None:
    for figure in figures.values():
        for curve in figure.curves:
            assert len(curve.folds) in (0, 2)
            assert curve.unstable_stretches == len(curve.folds) // 2
            assert np.all(curve.stable) == (not curve.folds)


def test_figure5_goes_from_the_free_to_the_stuck_frequency(figures: dict[int, Figure]) -> None:
    figure = figures[5]
    peaks = [curve.peak[0] for curve in figure.curves]
    assert [curve.v0 for curve in figure.curves] == sorted(curve.v0 for curve in figure.curves)
    assert all(a < b for a, b in pairwise(peaks))
    assert peaks[0] == pytest.approx(figure.free[0], rel=0.01)
    assert peaks[-1] == pytest.approx(figure.stuck[0], rel=0.001)
    assert figure.curves[0].v0 < 0.0 < figure.curves[-1].v0


def test_figure5_has_its_lowest_peak_in_between(figures: dict[int, Figure]) -> None:
    figure = figures[5]
    heights = [curve.peak[1] for curve in figure.curves]
    lowest = int(np.argmin(heights))
    assert 0 < lowest < len(heights) - 1
    assert all(a > b for a, b in pairwise(heights[: lowest + 1]))
    assert all(a < b for a, b in pairwise(heights[lowest:]))
    assert 20.0 * heights[lowest] < min(figure.free[1], figure.stuck[1])
    assert heights[-1] == pytest.approx(figure.stuck[1], rel=0.05)


def test_figure5_jumps_slightly_on_the_free_side_only(figures: dict[int, Figure]) -> None:
    figure = figures[5]
    gaps = [curve for curve in figure.curves if curve.v0 < 0.0]
    assert gaps
    for curve in gaps:
        # hardening: the curve leans to higher frequencies and comes back
        upper, lower = curve.folds
        assert figure.free[0] < lower < upper
        assert curve.peak[0] > figure.free[0]
        assert upper - lower < 0.05 * figure.free[0]
    lowest = min(figure.curves, key=lambda curve: curve.peak[1])
    for curve in figure.curves:
        if curve.v0 >= lowest.v0:
            assert curve.folds == []


def test_figure6_falls_all_the_way_to_full_stick(figures: dict[int, Figure]) -> None:
    figure = figures[6]
    heights = [curve.peak[1] for curve in figure.curves]
    peaks = [curve.peak[0] for curve in figure.curves]
    assert all(a > b for a, b in pairwise([figure.free[1], *heights]))
    assert all(a < b for a, b in pairwise([figure.free[0], *peaks]))
    # the last curve is the stuck limit itself, and nothing is lower
    assert heights[-1] == pytest.approx(figure.stuck[1], rel=1e-4)
    assert peaks[-1] == pytest.approx(figure.stuck[0], rel=1e-4)
    assert min(heights) == heights[-1]


def test_figure6_jumps_on_both_sides(figures: dict[int, Figure]) -> None:
    figure = figures[6]
    hardening = [curve for curve in figure.curves if curve.v0 < 0.0]
    softening = [curve for curve in figure.curves if curve.v0 > 0.0][:-1]
    assert len(hardening) >= 2
    assert len(softening) >= 2
    for curve in hardening:
        first, second = curve.folds
        assert first > second > figure.free[0]
        assert curve.peak[0] == pytest.approx(first, rel=1e-3)
    for curve in softening:
        # softening: met from below, the curve turns back to lower frequencies at once and its peak is at the low end
        low, high = sorted(curve.folds)
        assert low < high <= figure.stuck[0]
        assert curve.peak[0] == pytest.approx(low, rel=1e-3)
    # far more evident than at 70 degrees
    widest = {number: max(np.ptp(curve.folds or [0.0]) for curve in figures[number].curves) for number in (5, 6)}
    assert widest[6] > 5.0 * widest[5]


def test_figure7_hardens_with_the_engine_order(figures: dict[int, Figure]) -> None:
    figure = figures[7]
    orders = [curve.engine_order for curve in figure.curves]
    shifts = [curve.peak[0] - figure.free[0] for curve in figure.curves]
    jumps = [np.ptp(curve.folds or [0.0]) for curve in figure.curves]
    assert orders == sorted(orders)
    assert shifts[0] > 0.0
    assert all(a < b for a, b in pairwise(shifts))
    assert all(a < b for a, b in pairwise(jumps))
    assert {curve.v0 for curve in figure.curves} == {-8e-6}


def test_figure7_has_its_lowest_peak_near_engine_order_30(figures: dict[int, Figure]) -> None:
    figure = figures[7]
    heights = [curve.peak[1] for curve in figure.curves]
    lowest = int(np.argmin(heights))
    assert 25 <= figure.curves[lowest].engine_order <= 35
    assert all(a > b for a, b in pairwise(heights[: lowest + 1]))
    assert all(a < b for a, b in pairwise(heights[lowest:]))
    assert 2.0 * heights[lowest] < min(heights[0], heights[-1])
    assert load(7)["blade"]["n_blades"] > 60

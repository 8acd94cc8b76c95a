"""Captions of the figures on the page."""

from __future__ import annotations

_RESPONSE = (
    "Largest displacement over a period against frequency. Dashed: unstable; long dashes: against perturbations of "
    "another nodal diameter than the wave. Circles: peaks of the main branches. Stars: worst motions that are not "
    "these peaks. Thin lines: isolated and detached branches. Squares: Neimark-Sacker bifurcations, where the motion "
    "becomes or stops being quasi-periodic; triangles: period doublings; diamonds: branch points."
)
_BANDS = (
    "Quantiles of the largest displacement over the curves at each frequency (main branches), and the curves with "
    "the highest, the median and the lowest worst motion."
)
_PEAKS = (
    "Height and frequency of the worst motions, and of the peaks of the main branches (thin), against the swept "
    "parameter, with the linear limits. Triangles: the worst motion may be higher."
)
_QUANTILES = (
    "Quantiles of the worst motions and of their frequencies against each swept parameter; dots: single curves."
)
_OTHERS = {
    "map": (
        "Worst motion over the two swept parameters: height on the left, frequency on the right. Frame: the lowest; "
        "dots in the corner of a cell: it may be higher."
    ),
    "nodal_diameters": (
        "Natural frequencies against nodal diameter; excitation and frequency range are marked. Bars: resonance "
        "crossings from free to stuck shrouds, numbered as in the table. With a disk: modes "
        "by their names (F flap, E edge, T torsion, R radial, D disk), in colours the disk's share of strain energy."
    ),
    "campbell": (
        "Campbell diagram: natural frequencies against speed, with the lines of the engine orders. Diamonds: "
        "resonance crossings."
    ),
    "outputs": "Largest values of the further outputs over a period against frequency, their means included.",
    "hysteresis_sweep": (
        "Hysteresis loops of one contact node, each curve at its own peak; curves without contact are left out."
    ),
}


def captions(*, lines: bool, few: bool) -> dict[str, str]:
    """Captions by the name of the figure; `lines`: a line a curve, `few`: few lines over the swept parameter."""
    return {"response": _RESPONSE if lines else _BANDS, "peaks": _PEAKS if few else _QUANTILES, **_OTHERS}

"""Damping of all waves in the flow over the nodal diameter, the S-curve: with free, sliding and stuck shrouds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipeline.figures.campbell import LOOKS
from pipeline.figures.style import subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pipeline.stages.model.flutter import LinearFlutter

MOST = 4  # modes, a panel each


def flutter_figure(flutter: LinearFlutter | None, title: str) -> Figure | None:
    """A panel for each mode that the flow acts on, or that has flutter; None without a flow.

    The part below no damping is shaded.
    """
    if flutter is None:
        return None
    fed = {mode for mode, found in flutter.least() if min(ratio for ratio, *_ in found) < 0.0}
    modes = sorted({*flutter.families, *fed} & {mode for mode, _ in flutter.least()})[:MOST]
    figure, panels = subplots(len(modes), size=(7.2, 1.2 + 2.6 * len(modes)), sharex=True, squeeze=False)
    for mode, axes in zip(modes, panels[:, 0], strict=True):
        for waves in flutter.states:
            ratio = [100.0 * value for value in waves.damping_ratio[mode - 1]]
            axes.plot(flutter.nodal_diameter, ratio, label=f"shrouds {waves.contact}", **LOOKS[waves.contact])
        axes.margins(x=0.02)
        low, high = axes.get_ylim()
        axes.axhspan(min(low, 0.0), 0.0, color="#D55E00", alpha=0.12, zorder=0, linewidth=0.0, label="flutter")
        axes.set_ylim(low, max(high, 0.0))
        axes.axhline(0.0, color="0.3", linewidth=0.8)
        axes.set_ylabel(f"mode {mode}: damping ratio [%]")
    panels[-1, 0].set_xlabel("nodal diameter n (n > 0: backward wave, against the rotation; n < 0: forward wave)")
    panels[-1, 0].legend(loc="upper left", bbox_to_anchor=(0.0, -0.24), ncols=4, fontsize=8.5)
    write_heading(figure, title)
    return figure

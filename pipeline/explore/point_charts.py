"""Charts of one point of a curve: motion over a period, hysteresis and states of the contact nodes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.explore.charts import CELL_COLOURS, INK, LOOP_COLOUR, PALE, PALE_LOOP, Chart, fit, plain_figure, sources
from pipeline.report.viewer import ViewerData
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from pipeline.explore.points import LivePoint, LiveShape

ANGLES = [0, 90, 180, 270, 360]
MOST_LOOPS = 60  # nodes with a loop of their own
ROOM = 0.42  # half the height of a bar


@dataclass
class PointCharts(Chart):
    """The three charts, and the node whose loop stands out."""

    chosen: int | None = None
    shown: LivePoint | None = None

    @classmethod
    def of(cls) -> PointCharts:
        """Empty axes."""
        from bokeh.models import FixedTicker, Range1d, Span

        found = sources(motion="x y", pale="xs ys", loops="xs ys", bars="y left right colour")
        motion = plain_figure("motion", "phase [°]", "displacement", x_range=Range1d(0, 360))
        motion.line("x", "y", source=found["motion"], color=LOOP_COLOUR, line_width=2.0)
        loops = plain_figure("loops", "relative displacement", "friction force")
        loops.multi_line("xs", "ys", source=found["pale"], color=PALE_LOOP, line_width=1.0)
        loops.multi_line("xs", "ys", source=found["loops"], color=LOOP_COLOUR, line_width=1.6)
        cycle = plain_figure("cycle", "phase [°]", "node", x_range=Range1d(0, 360), y_range=Range1d(9.5, 0.5))
        cycle.hbar(
            "y", left="left", right="right", height=2 * ROOM, color="colour", line_color=None, source=found["bars"]
        )
        cycle.ygrid.visible = False
        cycle.add_layout(Span(name="phase", location=0, dimension="height", line_color=INK, line_width=1.2))
        for figure in (motion, cycle):
            figure.xaxis.ticker = FixedTicker(ticks=ANGLES)
            figure.xgrid.ticker = FixedTicker(ticks=ANGLES)
        motion.add_layout(Span(location=0, dimension="width", line_color=PALE, line_width=0.8))
        return cls([motion, loops, cycle], found)

    def show_point(self, found: LivePoint, unit: str, factor: float) -> dict[str, Any]:
        """Draw a point; the words and values for the rest of the page."""
        self.shown = found
        motion, _, cycle = self.figures
        angle = np.degrees([*found.angle, 2.0 * np.pi])
        moved = np.append(found.output_m, found.output_m[0]) * factor
        motion.yaxis.axis_label = f"displacement [{unit}]"
        fit(motion.y_range, moved.tolist())
        n = len(found.state)
        cycle.y_range.update(start=n + 0.5, end=0.5)
        self.show(motion={"x": angle.tolist(), "y": moved.tolist()}, bars=self._bars(found, angle))
        self._show_loops()
        unstable = "" if found.stable else ", unstable"
        return {
            "at": f"{found.frequency_hz:.5g} Hz, {found.amplitude_m * factor:.4g} {unit}{unstable}",
            "nodes": node_names(found),
            "faces": self._faces(found),
            "cycle": work_said(found),
        }

    def choose(self, node: int | None) -> None:
        """Let the loop of one node stand out; None: all alike."""
        self.chosen = node
        if self.shown is not None:
            self._show_loops()

    def _show_loops(self) -> None:
        assert self.shown is not None
        found, made = self.shown, self.figures[1]
        n = len(found.state)
        nodes = list(range(min(n, MOST_LOOPS)))
        chosen = nodes if self.chosen is None or self.chosen >= n else [self.chosen]
        along = int(np.argmax(np.ptp(found.cycle.displacement[:, :, :2], axis=0).sum(axis=0)))
        pairs = {node: found.loop(node, along) for node in {*nodes, *chosen}}
        length, unit = prefixed(max(float(np.abs(u).max()) for u, _ in pairs.values()), "m")
        newton, force_unit = prefixed(max(float(np.abs(force).max()) for _, force in pairs.values()), "N")

        def lines(which: list[int]) -> dict[str, Any]:
            return {
                "xs": [(pairs[node][0] * length).tolist() for node in which],
                "ys": [(pairs[node][1] * newton).tolist() for node in which],
            }

        pale, dark = lines(nodes), lines(chosen)
        self.show(pale=pale, loops=dark)
        fit(made.x_range, chain.from_iterable(pale["xs"] + dark["xs"]))
        fit(made.y_range, chain.from_iterable(pale["ys"] + dark["ys"]))
        made.xaxis.axis_label = f"relative displacement along t{along + 1} [{unit}]"
        made.yaxis.axis_label = f"friction force T{along + 1} [{force_unit}]"

    @staticmethod
    def _bars(found: LivePoint, angle: np.ndarray) -> dict[str, Any]:
        names = state_names()
        columns: dict[str, Any] = {"y": [], "left": [], "right": [], "colour": []}
        for node, states in enumerate(found.cycle.state.T.tolist(), start=1):
            changes = [0, *(k for k in range(1, len(states)) if states[k] != states[k - 1]), len(states)]
            for first, end in pairwise(changes):
                columns["y"].append(node)
                columns["left"].append(float(angle[first]))
                columns["right"].append(float(angle[end]))
                columns["colour"].append(CELL_COLOURS[names[states[first]]])
        return columns

    @staticmethod
    def _faces(found: LivePoint) -> dict[str, Any]:
        """Places of the nodes of each interface, and their states over the period."""
        places = [
            {
                "name": each.interface,
                "first": each.nodes.start,
                "x": each.place_m[:, 0].tolist(),
                "y": each.place_m[:, 1].tolist(),
            }
            for each in found.interfaces
        ]
        return {"places": places, "states": found.cycle.state.T.tolist(), "names": state_names()}


def state_names() -> dict[int, str]:
    """Names of contact states by their numbers."""
    from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK

    return {int(STICK): "stick", int(SLIP): "slip", int(LIFT_OFF): "open"}


def node_names(found: LivePoint) -> list[str]:
    """A name for each contact node: its number, after its interface where there are several."""
    several = len(found.interfaces) > 1
    return [
        f"{each.interface} {node + 1}" if several else str(node + 1)
        for each in found.interfaces
        for node in each.nodes
    ]


def work_said(found: LivePoint) -> str:
    """The friction work of a period, and the node with the most of it."""
    total = float(found.dissipated_j.sum())
    if not total > 0.0:
        return "No friction work."
    factor, unit = prefixed(total, "J")
    most = int(np.argmax(found.dissipated_j))
    percent = 100.0 * float(found.dissipated_j[most]) / total
    name = node_names(found)[most]
    return f"Friction work {total * factor:.4g} {unit} a period, {percent:.0f} % of it at node {name}."


def shape_plain(found: LiveShape, deformation: float) -> dict[str, Any]:
    """The shape for the viewer."""
    data = ViewerData(deformation)
    data.add_motion(found.points, found.surface, (found.n_blades, found.kind), found.motion)
    return data.plain()

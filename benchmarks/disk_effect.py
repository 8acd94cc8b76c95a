"""What an elastic disk changes: the curves of figures 5 to 7 with blades clamped at their roots, and on a disk.

    python benchmarks/disk_effect.py                      # all three: out/bench/disk_effect
    python benchmarks/disk_effect.py --figures figure7    # one of them, the others as measured before
    python benchmarks/disk_effect.py --docs               # and table and picture where they are kept

The disk is of the blade's steel, clamped at its bore. Worst motions are those of the program with all its options.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tables import ROOT, markdown_table, options_of, write_rows

if TYPE_CHECKING:
    from pipeline import Results

NAME = "disk_effect"
TABLE = ROOT / "benchmarks" / "measured" / "disk_effect.md"
PICTURE = ROOT / "docs" / "images" / "bladed_disk.png"
FIGURES = {"figure5": "contact.interference", "figure6": "contact.interference", "figure7": "excitation.engine_order"}
DISK: dict[str, Any] = {
    "bore_radius": 0.25,
    "bore_width": 0.1,
    "profile": [[0.30, 0.05], [0.50, 0.05]],
    "rim_width": 0.062,
}
RANGE_HZ = [1000.0, 3800.0]  # wider than that of the figures: the disk lowers the frequencies


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, NAME)
    parser.add_argument("--figures", nargs="+", choices=list(FIGURES), default=list(FIGURES))
    parser.add_argument("--size", type=float, help="of the mesh in place of that of the scenes, m")
    parser.add_argument("--docs", action="store_true")
    options = parser.parse_args(arguments)
    rows = read_rows(options.out / f"{NAME}.csv")
    for figure in options.figures:
        both = [results_of(figure, disk, options.out / f"{figure}_{disk}", options.size) for disk in (False, True)]
        rows = [row for row in rows if row["figure"] != figure] + rows_of(figure, *both)
        write_rows(options.out / f"{NAME}.csv", rows)
    text = report(rows)
    (options.out / f"{NAME}.md").write_text(text, encoding="utf-8")
    print(text)
    if options.docs:
        TABLE.write_text(text, encoding="utf-8")
        draw(options.out, PICTURE)
    return 0


def results_of(figure: str, disk: bool, out: Path, size: float | None = None) -> Results:
    """The curves of a figure, with blades on a disk or clamped; those that are stored are read."""
    from pipeline import run_scene

    changes: dict[str, Any] = {"response.frequency": RANGE_HZ}
    if size is not None:
        changes["mesh.size"] = size
    tables = {"disk": DISK} if disk else {}
    print(f"{figure}, {'on a disk' if disk else 'clamped'}", file=sys.stderr)
    scene = ROOT / "scenes" / f"{figure}.toml"
    return run_scene(scene, out, until="respond", overrides=changes, quiet=True, **tables)


def rows_of(figure: str, clamped: Results, elastic: Results) -> list[dict[str, Any]]:
    """A row for each curve of a figure."""
    key = FIGURES[figure]
    found = []
    for one, other in zip(clamped.curves, elastic.curves, strict=True):
        found.append(
            {
                "figure": figure,
                "key": key,
                "value": one.parameters[key],
                **{f"clamped_{name}": value for name, value in _worst(one).items()},
                **{f"disk_{name}": value for name, value in _worst(other).items()},
            }
        )
    return found


def _worst(curve: Any) -> dict[str, Any]:
    worst = curve.worst
    if worst is None:
        return {"hz": None, "m": None, "open": False}
    return {"hz": worst.frequency_hz, "m": worst.amplitude_m, "open": bool(worst.unresolved)}


def read_rows(file: Path) -> list[dict[str, Any]]:
    """The rows of an earlier run."""
    if not file.exists():
        return []
    with file.open(encoding="utf-8", newline="") as source:
        return [
            {name: value if name in ("figure", "key") else _value(value) for name, value in row.items()}
            for row in csv.DictReader(source)
        ]


def _value(text: str) -> Any:
    return text == "True" if text in ("True", "False") else float(text) if text else None


def report(rows: Sequence[dict[str, Any]]) -> str:
    """The table in Markdown."""
    lines = []
    for row in sorted(rows, key=lambda row: row["figure"]):
        value = f"{row['value'] * 1e6:g} µm" if "interference" in row["key"] else f"EO {row['value']:g}"
        lines.append([row["figure"], value, *(_said(row, state) for state in ("clamped", "disk"))])
    return markdown_table(["scene", "value", "clamped", "on a disk"], lines) + "\n"


def _said(row: dict[str, Any], state: str) -> str:
    hertz, height = row[f"{state}_hz"], row[f"{state}_m"]
    if height is None:
        return "not known"
    return f"{'>= ' if row[f'{state}_open'] else ''}{height * 1e6:.3g} µm at {hertz:.0f} Hz"


def draw(out: Path, file: Path) -> None:
    """The curves of the figures, clamped pale and on the disk bold."""
    from pipeline import read_results, styled
    from pipeline.figures.style import subplots

    with styled():
        figure, axes = subplots(1, len(FIGURES), size=(13.5, 5.4), sharey=True)
        for panel, (name, key) in zip(axes, FIGURES.items(), strict=True):
            for disk, look in ((False, {"linewidth": 0.8, "alpha": 0.5}), (True, {"linewidth": 1.6})):
                curves = read_results(out / f"{name}_{disk}").curves
                for number, curve in enumerate(curves):
                    value = curve.parameters[key]
                    label = f"{value * 1e6:g} µm" if "interference" in key else f"EO {value:g}"
                    said = {"label": label} if disk else {}
                    panel.semilogy(curve.frequency_hz, curve.amplitude_m * 1e6, color=f"C{number}", **look, **said)
            panel.set_title(f"{name}: clamped (thin), on a disk (bold)")
            panel.set_xlabel("frequency [Hz]")
            panel.legend(fontsize=8, ncols=5, loc="upper center", bbox_to_anchor=(0.5, -0.12), columnspacing=1.0)
        axes[0].set_ylabel("amplitude of the tip [µm]")
        figure.savefig(file, dpi=110)


if __name__ == "__main__":
    sys.exit(main())

"""The style of all figures: colours for the colour-blind, legible in grey, units with engineering prefixes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

# Palette of Okabe and Ito without its yellow, for curves without an order.
DISTINCT = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
# The hues of a rainbow, dark and light (L* = 38 and 68): taken in turn, neighbours differ in hue and in grey.
_DARK = (
    "#9214b8", "#1e4fca", "#145d94", "#12607e", "#116270", "#156461",
    "#10664d", "#0f6822", "#4b610a", "#6a580a", "#864b08", "#b31406",
)  # fmt: skip
_LIGHT = (
    "#de80fa", "#9b9dfa", "#5aaaf9", "#2ab2e5", "#2bb5cc", "#25b8b4",
    "#28bb91", "#25bf45", "#8db318", "#c3a318", "#f38c17", "#fb8467",
)  # fmt: skip
LIMIT_COLOUR = "0.65"
BEHIND = 1.5  # zorder of what lies behind the curves
LOG_FROM = 8.0  # ratio of the highest to the lowest peak above which an axis of points is logarithmic
CURVES_LOG_FROM = 30.0  # the same for whole curves, which a logarithm makes flat
LETTERS_AN_INCH = 11.0  # of a heading
LEGEND_LETTERS = 13.0  # an inch, of 9 points
SAMPLE = 6  # letters for which the sample of a line in a legend has the room
_SETTINGS: dict[str, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "figure.dpi": 160,
    "savefig.dpi": 160,
    "svg.hashsalt": "shroud",
    "svg.fonttype": "none",
}


@contextmanager
def styled() -> Iterator[None]:
    """matplotlib with the style of the figures whatever the user's own settings are, and without a display.

    Examples
    --------
    >>> from pipeline import styled
    >>> with styled():
    ...     import matplotlib
    ...     matplotlib.get_backend().lower()
    'agg'
    """
    import gc

    import matplotlib as mpl

    mpl.use("Agg")
    gc.freeze()  # what there is stays: to look through it again and again takes a tenth of the drawing
    try:
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(cast(Any, _SETTINGS))
            yield
    finally:
        gc.unfreeze()


def ordered_colours(count: int) -> list[Any]:
    """Colours for the curves of a sweep in the order of a rainbow, dark and light in turn.

    Parameters
    ----------
    count : int
        Number of colours.

    Returns
    -------
    list
        Colours that matplotlib accepts.

    Examples
    --------
    >>> from pipeline import ordered_colours
    >>> len(set(ordered_colours(8)))
    8
    """
    from matplotlib.colors import to_rgb

    if count <= 3:
        return list(DISTINCT[:count])
    hues, at = range(len(_DARK)), np.linspace(0.0, len(_DARK) - 1.0, count)
    dark, light = (
        np.stack([np.interp(at, hues, channel) for channel in zip(*map(to_rgb, shades), strict=True)], axis=1)
        for shades in (_DARK, _LIGHT)
    )
    return [tuple((light if k % 2 else dark)[k].tolist()) for k in range(count)]


def group_colours(count: int) -> list[Any]:
    """Colours of groups of curves by a second key: from the other end of the palette, so that few share any."""
    return list(DISTINCT[::-1][:count]) if count <= len(DISTINCT) else ordered_colours(count)


def scale(values: Sequence[float] | np.ndarray, unit: str) -> tuple[float, str]:
    """Factor and prefixed unit that bring the largest of the values between 1 and 1000."""
    finite = np.abs(np.asarray(values, dtype=float))
    finite = finite[np.isfinite(finite)]
    return prefixed(float(finite.max()) if finite.size else 0.0, unit)


def plain_log_labels(axis: Axis) -> None:
    """Labels 0.2, 1, 10 instead of powers of ten; between the decades 2 and 5 only."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    axis.set_major_locator(LogLocator(10.0, (1.0, 2.0, 5.0), numticks=20))
    axis.set_minor_locator(LogLocator(10.0, "all", numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(FuncFormatter(lambda value, _: ""))


def set_height_axis(axes: Axes, heights: NDArray[np.float64], log_from: float = LOG_FROM) -> bool:
    """The axis of some heights begins at zero, or is logarithmic where they span decades; returns which."""
    above = heights[np.isfinite(heights) & (heights > 0.0)]
    logarithmic = above.size > 0 and bool(above.max() > log_from * above.min())
    if logarithmic:
        axes.set_yscale("log")
        plain_log_labels(axes.yaxis)
    else:
        axes.set_ylim(bottom=0.0)
    return logarithmic


def write_heading(place: Axes | Figure, text: str) -> None:
    """Write a heading as it stands: the title of a scene is no formula, whatever dollar signs it has.

    Above a figure, a line longer than the figure is broken.
    """
    if hasattr(place, "suptitle"):
        figure: Any = place
        letters = int(LETTERS_AN_INCH * figure.get_size_inches()[0])
        lines = (fill(line, letters, break_on_hyphens=False) for line in text.split("\n"))
        place.suptitle("\n".join(lines), fontsize=11, parse_math=False)
    else:
        place.set_title(text, parse_math=False)


def legend_columns(figure: Figure, labels: Sequence[str], most: int) -> int:
    """Columns of a legend of 9 points across a figure, `most` of them, that have room for their longest labels."""
    room = LEGEND_LETTERS * figure.get_size_inches()[0]
    for count in range(min(most, len(labels)), 1, -1):
        columns = np.array_split(np.array([len(label) + SAMPLE for label in labels]), count)
        if sum(column.max() for column in columns) <= room:
            return count
    return 1


def subplots(
    rows: int = 1,
    columns: int = 1,
    *,
    size: tuple[float, float],
    sharex: bool | Literal["col"] = False,
    sharey: bool | Literal["row"] = False,
    squeeze: bool = True,
) -> tuple[Figure, Any]:
    """A figure of `size` (width, height in inches) with its axes, as those of pyplot, which takes long to import."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, sharex=sharex, sharey=sharey, squeeze=squeeze)


def save(figure: Figure, folder: Path, name: str, formats: Sequence[str] = ("png",), redraw: str = "") -> None:
    """Write the figure as `<name>.<format>`, in the formats "png" and "svg", and what it shows as `<name>.csv` where
    `redraw`, the command that draws it again, is given."""
    for form in formats:
        (folder / f"{name}.{form}").write_bytes(drawn(figure, form))
    if redraw:
        table = figure_table(figure, redraw)  # a path may hold bytes that the locale does not know
        (folder / f"{name}.csv").write_text(table, encoding="utf-8", errors="surrogateescape")


def drawn(figure: Figure, form: str) -> bytes:
    """The figure as "png" or "svg", the same bytes for the same content.

    The layout is computed once, and the figure drawn once: `savefig` computes the layout for each format anew, and
    draws everything twice.
    """
    import io

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    stream = io.BytesIO()
    if form == "svg":
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})
    else:
        FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})
    return stream.getvalue()


# places of a label around its point, in heights of the label: near ones first
_AROUND = [
    (x * far, y * far)
    for far in (0.8, 1.6, 2.6, 4.0, 6.0)
    for x, y in ((1, 0.5), (-1, 0.5), (1, -1), (-1, -1), (0, 1))
]

_BESIDE = _AROUND[:10]  # those that need no line to the point
TO_POINT: Mapping[str, Any] = {"arrowstyle": "-", "linewidth": 0.5, "color": "0.4", "shrinkA": 0, "shrinkB": 3}


def keep_apart(axes: Axes, labels: Sequence[Any]) -> None:
    """Move annotations around their points, so that none lies on another text, a point of them, or outside.

    A label without room is hidden; one far from its point has a line to it, or is hidden where it can have none.
    """
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    figure: Any = axes.figure
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # else the places change once more
    moved = set(labels)
    texts = [text for text in axes.texts if text not in moved and text.get_text() and text.get_visible()]
    taken = [text.get_window_extent() for text in texts]
    taken += [
        Bbox.from_extents(x - 3, y - 3, x + 3, y + 3) for x, y in (axes.transData.transform(e.xy) for e in labels)
    ]
    frame = axes.get_window_extent()
    for label in labels:
        for x, y in _AROUND if label.arrow_patch is not None else _BESIDE:
            size = float(label.get_fontsize())
            label.set_position((x * size, y * size))
            label.set_horizontalalignment("left" if x > 0.0 else "right" if x < 0.0 else "center")
            box = Text.get_window_extent(label).padded(0.25 * size)  # without its line
            inside = frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
            if inside and not any(box.overlaps(other) for other in taken):
                taken.append(box.padded(0.1 * size))
                if label.arrow_patch is not None:
                    label.arrow_patch.set_visible(abs(y) > 1.0)
                break
        else:
            label.set_visible(False)


_GIVEN = "shown_columns"  # attribute of axes with data of their own


def give_data(axes: Axes, columns: Mapping[str, Sequence[Any]]) -> None:
    """Columns, units in their names, that the table of the figure has of these axes in place of what is drawn.

    For axes whose coordinates are no values, as those of a map of cells or on logarithms.
    """
    setattr(axes, _GIVEN, columns)


def figure_table(figure: Figure, redraw: str) -> str:
    """What a figure draws as CSV: a row for each point, a column for each labelled axis, empty where it has none.

    `panel` is the heading of the axes or their number, `series` the name of a line, area or group of points: its
    label, without the underscore of those that are not in the legend; what has no label is no data.
    """
    import csv
    import io

    rows: list[dict[str, Any]] = []
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    for number, axes in enumerate(panels, 1):
        panel = axes.get_title().replace("\n", ", ") if len(panels) > 1 else ""
        for row in _rows(axes):
            rows.append({"panel": panel or number, **row})
    stream = io.StringIO()
    stream.write(f"# redraw: {redraw}\n")
    columns = dict.fromkeys(["panel", "series", *(name for row in rows for name in row)])
    table = csv.DictWriter(stream, list(columns), lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: f"{v:.9g}" if isinstance(v, float) else v for name, v in row.items()})
    return stream.getvalue()


def _rows(axes: Axes) -> Iterator[dict[str, Any]]:
    """A row for each point of the artists of some axes."""
    given: Mapping[str, Sequence[Any]] | None = getattr(axes, _GIVEN, None)
    if given is not None:
        yield from (dict(zip(given, values, strict=True)) for values in zip(*given.values(), strict=True))
        return
    names = _axis_name(axes, "x"), _axis_name(axes, "y")
    for artist in (*axes.lines, *axes.collections, *axes.patches):
        label = str(artist.get_label())
        if not label or label.startswith(("_child", "_nolegend")):
            continue
        bar = getattr(artist, "colorbar", None)
        colour = "" if bar is None else bar.ax.get_ylabel() or bar.ax.get_xlabel()
        in_data = artist.get_transform().contains_branch_seperately(axes.transData)
        if not any(in_data):
            in_data = True, True  # offsets of points, corners of a patch
        for *place, value in _points(artist):
            row = {name: at for name, at, known in zip(names, place, in_data, strict=True) if known}
            yield {"series": label.removeprefix("_"), **row, **({colour: value} if colour else {})}


def _points(artist: Artist) -> Iterator[tuple[float, float, Any]]:
    """Points of an artist with the values that its colours stand for."""
    from matplotlib.collections import Collection, PathCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if isinstance(artist, Line2D):
        places = np.asarray(artist.get_xydata(), dtype=float)
    elif isinstance(artist, PathCollection):
        places = np.ma.filled(np.ma.asarray(artist.get_offsets(), dtype=float), np.nan)
    elif isinstance(artist, Collection):
        places = np.concatenate([path.vertices for path in artist.get_paths()] or [np.empty((0, 2))])
    else:
        assert isinstance(artist, Patch)
        places = artist.get_patch_transform().transform(artist.get_path().vertices)
    values = artist.get_array() if isinstance(artist, PathCollection) else None
    for number, (x, y) in enumerate(places):
        if np.isfinite(x) and np.isfinite(y):
            yield float(x), float(y), "" if values is None else float(values[number])


def _axis_name(axes: Axes, name: Literal["x", "y"]) -> str:
    """Label of an axis, of the one that it shares, or of the figure."""
    figure: Any = axes.figure
    group = axes.get_shared_x_axes() if name == "x" else axes.get_shared_y_axes()
    for each in (axes, *group.get_siblings(axes)):
        label = (each.get_xlabel() if name == "x" else each.get_ylabel()).partition("\n")[0]
        if label:
            return str(label).replace("$", "")
    return str((figure.get_supxlabel() if name == "x" else figure.get_supylabel()) or name)

"""A small blade that builds in a second or two, and a reduced model with no blade behind it."""

import copy
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pipeline.figures.style
import pipeline.report.charts
import pipeline.run
from pipeline.cli import command
from rom import ReducedModel, write_reduced_model

# texts of pydantic, of tomllib and of Python that say nothing to a user
RAW_TEXT = re.compile(
    r"[Vv]alue error|Input should|[Vv]alidation ?[Ee]rror|pydantic|Traceback|Error: |\berrno\b|Cannot overwrite|"
    r"Cannot declare|Cannot redefine|Cannot mutate|Expected|Invalid|Unclosed|Unterminated|Illegal|Unescaped|"
    r"Duplicate inline|Escaped char|Found invalid|\(at (line|end)|NoneType|object has no|<class"
)
DRAWN = pipeline.figures.style.drawn

# The main branch alone: most tests are not about the curve.
MAIN_BRANCH: dict[str, Any] = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}

SMALL: dict[str, Any] = {
    "name": "small",
    "title": "Small blade",
    "blade": {
        "n_blades": 72,
        "hub_radius": 0.3,
        "length": 0.15,
        "chord": 0.036,
        "thickness": 0.009,
        "section": "rectangle",
    },
    "shroud": {"angle": 70.0, "thickness": 0.005, "axial_width": 0.040, "contact_length": 0.012},
    "material": {"young_modulus": 210e9, "poisson_ratio": 0.3, "density": 7850.0},
    "mesh": {"size": 0.009, "element": "hex8", "contact_grid": [2, 2]},
    "rom": {"modes": 6},
    "load": {"speed_rpm": 0.0},
    "contact": {
        "normal_stiffness": 2e5,
        "tangential_stiffness": 1.5e5,
        "friction": 0.4,
        "interference": 1e-5,
        "integration": "sampled",
        "samples": 64,
    },
    "excitation": {"engine_order": 36, "force": 0.2, "direction": "y", "at": "tip"},
    "response": {"frequency": [300.0, 700.0], "harmonics": 1, "damping_ratio": 0.01, **MAIN_BRANCH},
}
WHOLE: dict[str, Any] = {f"response__{key}": None for key in MAIN_BRANCH}  # all that a run finds out unasked


def small_scene(**changes: Any) -> dict[str, Any]:
    """A copy of the small scene; keys like `contact__friction=0.2` change a value, None removes it."""
    scene = copy.deepcopy(SMALL)
    for dotted, value in changes.items():
        *sections, key = dotted.split("__")
        table = scene
        for section in sections:
            table = table.setdefault(section, {})
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    return scene


def ground_scene(**contact: Any) -> dict[str, Any]:
    """A scene without a blade, for `ground_model`: parameters node by node, preload, contact against ground."""
    return {
        "name": "ground",
        "contact": {
            "normal_stiffness": [0.8, 0.7, 0.9],
            "tangential_stiffness": [0.4, 0.5, 0.3],
            "friction": [0.5, 0.4, 0.6],
            "preload": [1.6, 1.2, 1.0],
            "integration": "sampled",
            "samples": 128,
            **contact,
        },
        "excitation": {"engine_order": 0, "force": 0.5},
        "response": {"frequency": [0.1, 0.3], "rayleigh": [0.0, 0.02], **MAIN_BRANCH},
    }


def ground_model(**changes: Any) -> ReducedModel:
    """Four masses of three directions each on a line of springs; the first three touch the ground."""
    line = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    stiffness = np.kron(line, np.array([[1.0, 0.0, 0.2], [0.0, 1.5, 0.0], [0.2, 0.0, 2.0]])) * 4.0
    force, output = np.zeros(12), np.zeros(12)
    force[9], force[11], output[9] = 1.0, 0.5, 1.0
    values = {
        "mass": np.eye(12),
        "stiffness": stiffness,
        "contact_right": np.eye(9, 12),
        "contact_position": np.column_stack([np.arange(3.0), np.zeros(3), np.zeros(3)]),
        "force_excitation": force,
        "outputs": {"tip": output},
        "producer": "a test",
    }
    return ReducedModel(**(values | changes))


def write_ground_model(path: Path, **changes: Any) -> Path:
    """`ground_model` as a file."""
    write_reduced_model(path, ground_model(**changes))
    return path


def write_scene(path: Path, scene: Mapping[str, Any]) -> Path:
    """Write a scene as TOML."""
    path.write_text(to_toml(scene), encoding="utf-8")
    return path


def to_toml(scene: Mapping[str, Any]) -> str:
    """Plain tables of plain values as TOML."""
    top = [f"{json.dumps(k)} = {_value(v)}" for k, v in scene.items() if not isinstance(v, Mapping)]
    for name, table in scene.items():
        if isinstance(table, Mapping):
            top += ["", f"[{json.dumps(name)}]", *(f"{json.dumps(k)} = {_value(v)}" for k, v in table.items())]
    return "\n".join(top) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, date):
        return value.isoformat()
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def shroud(*arguments: object) -> tuple[int, str, str]:
    """Run a command line in this process; exit status, stdout, stderr."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = command([str(a) for a in arguments])
    return status, out.getvalue(), err.getvalue()


def without_lines(error: str) -> str:
    """Complaints about scenes without the numbers of their lines."""
    return re.sub(r"\.toml:\d+: ", ".toml: ", error)


@contextmanager
def drawing() -> Iterator[None]:
    """Figures are drawn within the block, though `blank_figures` holds for the test."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (pipeline.figures.style, pipeline.report.charts):
            patch.setattr(module, "drawn", DRAWN)
        yield


@contextmanager
def without_stress_pictures() -> Iterator[None]:
    """Within the block pictures of stress are files without content: a process draws each for some seconds."""

    def draw(module: str, text: str, pictures: list[Path]) -> None:
        for picture in pictures:
            picture.touch()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pipeline.stress.stress_stage.draw_apart", draw)
        yield


@contextmanager
def changing_when_locked(change: Callable[[], object]) -> Iterator[None]:
    """Within the block a run calls `change` when it asks for its output folder, as if it had to wait for it."""
    real = pipeline.run.working_store

    @contextmanager
    def waited(*arguments: Any) -> Iterator[Any]:
        change()
        with real(*arguments) as store:
            yield store

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline.run, "working_store", waited)
        yield


def summary_of(folder: Path) -> dict[str, Any]:
    """summary.json of an output folder."""
    return json.loads((folder / "summary.json").read_text())


def statuses(folder: Path) -> dict[str, str]:
    """Stage -> ran, reused or skipped."""
    return {name: stage["status"] for name, stage in summary_of(folder)["stages"].items()}


def overlapping_texts(figure: Any) -> list[tuple[str, str]]:
    """Pairs of texts of a figure whose boxes overlap by more than a pixel, as matplotlib lays them out; a text that
    the edge of the figure cuts stands alone."""
    figure.draw_without_rendering()
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [axes.title, *axes.texts, *(axes.get_legend().get_texts() if axes.get_legend() else ())]
        for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
            low, high = sorted(axis.get_view_interval())
            texts += [axis.label, *(t.label1 for t in axis.get_major_ticks() if low <= t.get_loc() <= high)]
    shown = [text for text in texts if text.get_visible() and text.get_text().strip()]
    boxes = [text.get_window_extent().padded(-1.0) for text in shown]
    page = figure.bbox.padded(1.0)
    cut = [text.get_text() for text, box in zip(shown, boxes, strict=True) if not _contains(page, box)]
    return [(text, "") for text in cut] + [
        (shown[i].get_text(), shown[k].get_text())
        for i in range(len(shown))
        for k in range(i)
        if boxes[i].overlaps(boxes[k])
    ]


def _contains(page: Any, box: Any) -> bool:
    return bool(page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1)

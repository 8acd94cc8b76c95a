"""Scene files, stages and their cached results, sweeps, figures, renders and the command line; no equations.

The Python interface: `run_scene`, `read_results` and what they return. A name is imported from its module when it is
first asked for, so `import pipeline` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.errors import InputError
    from pipeline.explore.start import Explorer
    from pipeline.figures.curve_line import plot_curve
    from pipeline.figures.performance_figure import linear_peaks, performance_figure
    from pipeline.figures.style import ordered_colours, styled
    from pipeline.python_interface import explore_scene, run_scene
    from pipeline.results.curves import Curve, DetachedBranch
    from pipeline.results.results import Results, read_results
    from pipeline.scene.reading import Member, SceneFile, read_scene

__version__ = "0.3.0"

__all__ = [
    "Curve",
    "DetachedBranch",
    "Explorer",
    "InputError",
    "Member",
    "Results",
    "SceneFile",
    "explore_scene",
    "linear_peaks",
    "ordered_colours",
    "performance_figure",
    "plot_curve",
    "read_results",
    "read_scene",
    "run_scene",
    "styled",
]

_PLACES = {
    "Curve": "pipeline.results.curves",
    "DetachedBranch": "pipeline.results.curves",
    "Explorer": "pipeline.explore.start",
    "InputError": "pipeline.errors",
    "Member": "pipeline.scene.reading",
    "Results": "pipeline.results.results",
    "SceneFile": "pipeline.scene.reading",
    "explore_scene": "pipeline.python_interface",
    "linear_peaks": "pipeline.figures.performance_figure",
    "ordered_colours": "pipeline.figures.style",
    "performance_figure": "pipeline.figures.performance_figure",
    "plot_curve": "pipeline.figures.curve_line",
    "read_results": "pipeline.results.results",
    "read_scene": "pipeline.scene.reading",
    "run_scene": "pipeline.python_interface",
    "styled": "pipeline.figures.style",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'pipeline' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])

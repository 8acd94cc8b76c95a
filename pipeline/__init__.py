"""Scene files, stages and their reuse, sweeps, figures, renders and the command line; no equations.

The front door for Python: `run_scene`, `read_results` and what they return. What a name needs is imported when the
name is first asked for, so `import pipeline` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.errors import InputError
    from pipeline.figures.curve_line import plot_curve
    from pipeline.figures.style import ordered_colours, styled
    from pipeline.results import Curve, Results, read_results
    from pipeline.scene_file import Member, SceneFile, read_scene
    from pipeline.scene_run import run_scene

__all__ = [
    "Curve",
    "InputError",
    "Member",
    "Results",
    "SceneFile",
    "ordered_colours",
    "plot_curve",
    "read_results",
    "read_scene",
    "run_scene",
    "styled",
]

_PLACES = {
    "Curve": "pipeline.results",
    "InputError": "pipeline.errors",
    "Member": "pipeline.scene_file",
    "Results": "pipeline.results",
    "SceneFile": "pipeline.scene_file",
    "ordered_colours": "pipeline.figures.style",
    "plot_curve": "pipeline.figures.curve_line",
    "read_results": "pipeline.results",
    "read_scene": "pipeline.scene_file",
    "run_scene": "pipeline.scene_run",
    "styled": "pipeline.figures.style",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'pipeline' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])

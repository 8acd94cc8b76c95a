from pipeline.errors import InputError as InputError
from pipeline.explore.start import Explorer as Explorer
from pipeline.figures.curve_line import plot_curve as plot_curve
from pipeline.figures.performance_figure import linear_peaks as linear_peaks
from pipeline.figures.performance_figure import performance_figure as performance_figure
from pipeline.figures.style import ordered_colours as ordered_colours
from pipeline.figures.style import styled as styled
from pipeline.python_interface import explore_scene as explore_scene
from pipeline.python_interface import identify_scene as identify_scene
from pipeline.python_interface import run_scene as run_scene
from pipeline.results.curves import Curve as Curve
from pipeline.results.curves import DetachedBranch as DetachedBranch
from pipeline.results.results import Results as Results
from pipeline.results.results import read_results as read_results
from pipeline.scene.reading import Member as Member
from pipeline.scene.reading import SceneFile as SceneFile
from pipeline.scene.reading import read_scene as read_scene
from pipeline.studies.identify.result import Identification as Identification

__version__: str
__all__: list[str]

"""Nonlinear forced response of shrouded turbine blades, from blade geometry to response curves.

`run_scene` runs a scene file, `read_results` reads what an earlier run left; the other names are the objects behind
them. The packages of the program are `shroud.geometry`, `shroud.rom`, `shroud.nonlinear` and `shroud.pipeline`. A
name is imported from its package when it is first asked for, so `import shroud` costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")


class PackageNameError(ImportError):
    """Another module has the name of a package of shroud and stands before it on the search path of Python.

    Examples
    --------
    A file `rom.py` beside the script comes before the package of shroud.

    >>> from shroud import PackageNameError
    >>> try:
    ...     raise PackageNameError("/home/me/rom.py: has the name of the package rom of shroud; rename it")
    ... except ImportError as error:
    ...     print(error)
    /home/me/rom.py: has the name of the package rom of shroud; rename it
    """


def _origin(name: str) -> Path | None:
    """File or folder that `import name` takes, or has taken; None: there is none."""
    loaded = getattr(sys.modules.get(name), "__spec__", None)
    spec = loaded if loaded is not None else find_spec(name)
    if spec is None:
        return None
    if spec.submodule_search_locations:  # a package, with an __init__.py or without
        return Path(next(iter(spec.submodule_search_locations)))
    return Path(spec.origin) if spec.origin else None


def _check_packages() -> None:
    """Refuse packages that are not ours, before one of them is imported.

    Raises
    ------
    PackageNameError
        Names the file that is in the way.
    """
    own = Path(__file__).resolve().parent
    for name in PACKAGES:
        found = _origin(name)
        if found is None:
            raise PackageNameError(f"{own}: the package {name} of shroud is missing; install shroud again")
        if found.resolve() != own / name:
            raise PackageNameError(f"{found}: has the name of the package {name} of shroud; rename it")


_check_packages()

from pipeline import __all__ as _of_pipeline  # noqa: E402 - after the check

if TYPE_CHECKING:
    from nonlinear import Bifurcation as Bifurcation
    from nonlinear import BifurcationKind as BifurcationKind
    from nonlinear import Peak as Peak
    from nonlinear import WorstMotion as WorstMotion
    from pipeline import *  # noqa: F403
    from pipeline import __version__ as __version__
    from rom import ReducedModel as ReducedModel
    from rom import ReducedModelError as ReducedModelError

_OF_NONLINEAR = ["Bifurcation", "BifurcationKind", "Peak", "WorstMotion"]
_OF_ROM = ["ReducedModel", "ReducedModelError"]

_ALIASES = {"explore": "explore_scene", "identify": "identify_scene"}  # these are modules of pipeline

__all__ = ["PackageNameError", "__version__", *_ALIASES, *_of_pipeline, *_OF_NONLINEAR, *_OF_ROM]


def __getattr__(name: str) -> Any:
    if name in PACKAGES:
        return import_module(name)
    if name not in __all__:
        raise AttributeError(f"module 'shroud' has no attribute {name!r}")
    package = "nonlinear" if name in _OF_NONLINEAR else "rom" if name in _OF_ROM else "pipeline"
    return getattr(import_module(package), _ALIASES.get(name, name))


def __dir__() -> list[str]:
    return sorted({*__all__, *PACKAGES})

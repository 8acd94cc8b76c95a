"""The studies by name: each is imported where it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.studies.study import Study


def study_named(name: str) -> Study:
    """The study of a section of the scene."""
    if name == "optimum":
        from pipeline.studies.optimum.optimum_study import OptimumStudy

        return OptimumStudy()
    if name == "backbone":
        from pipeline.studies.backbone.backbone_study import BackboneStudy

        return BackboneStudy()
    if name == "map":
        from pipeline.studies.worst_motion_map.map_study import MapStudy

        return MapStudy()
    if name == "uncertainty":
        from pipeline.studies.uncertainty.uncertainty_study import UncertaintyStudy

        return UncertaintyStudy()
    if name == "mistuning":
        from pipeline.studies.mistuning.mistuning_study import MistuningStudy

        return MistuningStudy()
    raise KeyError(name)

"""Materials of a scene by the names that the elements of its mesh have."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.mesh_findings import own_findings

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from rom import Material

DISK = "disk"  # elements of the disk made here
NEEDED = ("young_modulus", "poisson_ratio", "density")


def scene_materials(scene: Scene, sector_file: Path) -> Material | dict[str, Material]:
    """The material of a scene, or those of its mesh file: [materials.NAME] before those of the file.

    Elements without a material, and those whose material has not all numbers, have [material]. The disk made here has
    [materials.disk], or [material] without one.

    Parameters
    ----------
    scene : Scene
        The scene.
    sector_file : Path
        The mesh of its sector, beside what was found in the mesh file.

    Raises
    ------
    ParameterError
        Elements are left without a material.
    """
    from rom import Material

    general = None if scene.material is None else Material(**scene.material.model_dump())
    named = {name: Material(**values.model_dump()) for name, values in scene.materials.items()}
    if scene.mesh_file is None:
        assert general is not None  # a scene that describes a blade has one
        return general if scene.disk is None else {"": general, DISK: named.get(DISK, general)}
    found = own_findings(sector_file.parent)
    in_file = found["materials"]
    return {name: named.get(name) or _material(name, in_file.get(name, {}), general) for name in found["used"]}


def _material(name: str, numbers: dict[str, Any], general: Material | None) -> Material:
    """A material of the file, or the general one."""
    from geometry import ParameterError
    from rom import Material

    if all(key in numbers for key in NEEDED):
        return Material(**numbers)
    if general is not None:
        return general
    lacking = ", ".join(key for key in NEEDED if key not in numbers)
    if not name:
        raise ParameterError("material", "", "missing", "a table [material]: elements of the file have none")
    allowed = f"a table [materials.{name}] or [material]: the file has no {lacking} of it"
    raise ParameterError("materials", name, "missing", allowed)

"""Blade and shroud geometry and its mesh: no material, no matrices, no frequencies.

A name is imported from its module when it is first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry.blade.build import build_sector
    from geometry.blade.checks import check_parameters
    from geometry.blade.fitting import side_edge_angle
    from geometry.blade.parameters import (
        BladeParameters,
        DiskParameters,
        MeshParameters,
        PlatformParameters,
        ShroudParameters,
        SnubberParameters,
    )
    from geometry.elements import ELEMENT_KINDS, ElementBlock, ElementKind, ElementSides, sides_on
    from geometry.errors import GeometryError, MeshFileError, OwnMeshError, ParameterError, SectorFileError
    from geometry.exchange import MESHIO_CELLS, cell_library, export_sector, import_sector
    from geometry.frames import NAMED_AXES, axes_through, contact_frames, rotate_about_axis
    from geometry.hdf5_content import check_dataset, check_links
    from geometry.imported_mesh import ImportedMesh
    from geometry.mesh_files.read import included_names, read_mesh
    from geometry.mesh_files.write import write_mesh
    from geometry.own_mesh.interfaces import found_interfaces
    from geometry.own_mesh.matching_faces import named_cuts
    from geometry.own_mesh.own_sector import OwnSector, SectorFindings, sector_from_mesh
    from geometry.own_mesh.ring import SectorRing, fitting_ring, ring_of_faces
    from geometry.own_mesh.sector_choice import InterfaceChoice, SectorChoice
    from geometry.quality import hexahedron_scaled_jacobian, scaled_jacobian
    from geometry.sector import ContactFace, FacePair, SectorMesh, check_sector, interface_of
    from geometry.subdivision import subdivided
    from geometry.units import BLADE_RADII, UNIT_SYSTEMS, UnitSystem

__all__ = [
    "BLADE_RADII",
    "ELEMENT_KINDS",
    "MESHIO_CELLS",
    "NAMED_AXES",
    "UNIT_SYSTEMS",
    "BladeParameters",
    "ContactFace",
    "DiskParameters",
    "ElementBlock",
    "ElementKind",
    "ElementSides",
    "FacePair",
    "GeometryError",
    "ImportedMesh",
    "InterfaceChoice",
    "MeshFileError",
    "MeshParameters",
    "OwnMeshError",
    "OwnSector",
    "ParameterError",
    "PlatformParameters",
    "SectorChoice",
    "SectorFileError",
    "SectorFindings",
    "SectorMesh",
    "SectorRing",
    "ShroudParameters",
    "SnubberParameters",
    "UnitSystem",
    "axes_through",
    "build_sector",
    "cell_library",
    "check_dataset",
    "check_links",
    "check_parameters",
    "check_sector",
    "contact_frames",
    "export_sector",
    "fitting_ring",
    "found_interfaces",
    "hexahedron_scaled_jacobian",
    "import_sector",
    "included_names",
    "interface_of",
    "named_cuts",
    "read_mesh",
    "ring_of_faces",
    "rotate_about_axis",
    "scaled_jacobian",
    "sector_from_mesh",
    "side_edge_angle",
    "sides_on",
    "subdivided",
    "write_mesh",
]

_PLACES = {
    "DiskParameters": "geometry.blade.parameters",
    "ELEMENT_KINDS": "geometry.elements",
    "MESHIO_CELLS": "geometry.exchange",
    "NAMED_AXES": "geometry.frames",
    "BLADE_RADII": "geometry.units",
    "UNIT_SYSTEMS": "geometry.units",
    "BladeParameters": "geometry.blade.parameters",
    "ContactFace": "geometry.sector",
    "ElementBlock": "geometry.elements",
    "ElementKind": "geometry.elements",
    "ElementSides": "geometry.elements",
    "FacePair": "geometry.sector",
    "GeometryError": "geometry.errors",
    "ImportedMesh": "geometry.imported_mesh",
    "InterfaceChoice": "geometry.own_mesh.sector_choice",
    "MeshFileError": "geometry.errors",
    "MeshParameters": "geometry.blade.parameters",
    "OwnMeshError": "geometry.errors",
    "OwnSector": "geometry.own_mesh.own_sector",
    "ParameterError": "geometry.errors",
    "PlatformParameters": "geometry.blade.parameters",
    "SectorChoice": "geometry.own_mesh.sector_choice",
    "SectorFileError": "geometry.errors",
    "SectorFindings": "geometry.own_mesh.own_sector",
    "SectorMesh": "geometry.sector",
    "SectorRing": "geometry.own_mesh.ring",
    "ShroudParameters": "geometry.blade.parameters",
    "SnubberParameters": "geometry.blade.parameters",
    "UnitSystem": "geometry.units",
    "axes_through": "geometry.frames",
    "build_sector": "geometry.blade.build",
    "cell_library": "geometry.exchange",
    "check_dataset": "geometry.hdf5_content",
    "check_links": "geometry.hdf5_content",
    "check_parameters": "geometry.blade.checks",
    "check_sector": "geometry.sector",
    "contact_frames": "geometry.frames",
    "export_sector": "geometry.exchange",
    "fitting_ring": "geometry.own_mesh.ring",
    "found_interfaces": "geometry.own_mesh.interfaces",
    "hexahedron_scaled_jacobian": "geometry.quality",
    "import_sector": "geometry.exchange",
    "included_names": "geometry.mesh_files.read",
    "interface_of": "geometry.sector",
    "named_cuts": "geometry.own_mesh.matching_faces",
    "read_mesh": "geometry.mesh_files.read",
    "ring_of_faces": "geometry.own_mesh.ring",
    "rotate_about_axis": "geometry.frames",
    "scaled_jacobian": "geometry.quality",
    "sector_from_mesh": "geometry.own_mesh.own_sector",
    "side_edge_angle": "geometry.blade.fitting",
    "sides_on": "geometry.elements",
    "subdivided": "geometry.subdivision",
    "write_mesh": "geometry.mesh_files.write",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'geometry' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])

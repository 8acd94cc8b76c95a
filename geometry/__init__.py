"""Blade and shroud geometry and its mesh: no material, no matrices, no frequencies."""

from geometry.build import build_sector
from geometry.checks import check_parameters
from geometry.edge_angle import side_edge_angle
from geometry.elements import ELEMENT_KINDS, ElementBlock, ElementKind, ElementSides, sides_on
from geometry.errors import GeometryError, MeshFileError, OwnMeshError, ParameterError, SectorFileError
from geometry.exchange import MESHIO_CELLS, cell_library, export_sector, import_sector
from geometry.imported_mesh import ImportedMesh
from geometry.mesh_files import read_mesh, write_mesh
from geometry.own_mesh.findings import SectorFindings
from geometry.own_mesh.own_sector import OwnSector, sector_from_mesh
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.parameters import BladeParameters, MeshParameters, ShroudParameters
from geometry.quality import hexahedron_scaled_jacobian, scaled_jacobian
from geometry.sector import ContactFace, SectorMesh
from geometry.sector_check import check_sector
from geometry.subdivision import subdivided

__all__ = [
    "ELEMENT_KINDS",
    "MESHIO_CELLS",
    "BladeParameters",
    "ContactFace",
    "ElementBlock",
    "ElementKind",
    "ElementSides",
    "GeometryError",
    "ImportedMesh",
    "MeshFileError",
    "MeshParameters",
    "OwnMeshError",
    "OwnSector",
    "ParameterError",
    "SectorChoice",
    "SectorFileError",
    "SectorFindings",
    "SectorMesh",
    "ShroudParameters",
    "build_sector",
    "cell_library",
    "check_parameters",
    "check_sector",
    "export_sector",
    "hexahedron_scaled_jacobian",
    "import_sector",
    "read_mesh",
    "scaled_jacobian",
    "sector_from_mesh",
    "side_edge_angle",
    "sides_on",
    "subdivided",
    "write_mesh",
]

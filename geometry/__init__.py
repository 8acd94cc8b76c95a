"""Blade and shroud geometry and its mesh: no material, no matrices, no frequencies."""

from geometry.build import build_sector
from geometry.checks import check_parameters
from geometry.errors import GeometryError, SectorFileError
from geometry.exchange import export_sector, import_sector
from geometry.hdf5 import UNREADABLE, opened, stored_array, why_unreadable
from geometry.hdf5_writing import new_hdf5
from geometry.parameters import BladeParameters, MeshParameters, ShroudParameters
from geometry.quality import hexahedron_scaled_jacobian
from geometry.sector import ContactFace, SectorMesh
from geometry.storage import load_sector, save_sector

__all__ = [
    "UNREADABLE",
    "BladeParameters",
    "ContactFace",
    "GeometryError",
    "MeshParameters",
    "SectorFileError",
    "SectorMesh",
    "ShroudParameters",
    "build_sector",
    "check_parameters",
    "export_sector",
    "hexahedron_scaled_jacobian",
    "import_sector",
    "load_sector",
    "new_hdf5",
    "opened",
    "save_sector",
    "stored_array",
    "why_unreadable",
]

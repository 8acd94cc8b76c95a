"""Materials of Abaqus and CalculiX input files."""

from __future__ import annotations

from geometry.errors import MeshFileError
from geometry.mesh_files.abaqus_keywords import KeywordBlock
from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.text_files import numbers

NUMBERS = {
    "ELASTIC": ("young_modulus", "poisson_ratio"),
    "DENSITY": ("density",),
    "EXPANSION": ("expansion",),
}
ISOTROPIC = ("", "ISO", "ISOTROPIC")
OTHER_LAWS = ("HYPERELASTIC", "HYPERFOAM", "LOW DENSITY FOAM", "USER MATERIAL", "UMAT", "ANISOTROPIC HYPERELASTIC")
# what a linear material leaves out of such a one
LEFT_OUT = ("PLASTIC", "CYCLIC HARDENING", "CREEP", "VISCOELASTIC", "DAMPING", "DEFORMATION PLASTICITY")
SCALING = ("MASS ADJUST", "FIXED MASS SCALING", "VARIABLE MASS SCALING")
SCALED = "changes the masses of the model: remove it and give the densities that it makes"


def add_materials(mesh: FileMesh, blocks: list[KeywordBlock]) -> None:
    """Properties by material, and what is left out of them."""
    current = ""
    for block in blocks:
        if block.keyword in SCALING:
            raise block.refuse(SCALED)
        if block.keyword == "MATERIAL":
            current = block.needs("NAME")
            mesh.materials.setdefault(current, {})
        elif current and block.keyword in OTHER_LAWS:
            mesh.unread_materials.setdefault(current, f"*{block.keyword}")
        elif current and block.keyword in LEFT_OUT:
            mesh.remark(current, f"material {current}: *{block.keyword} left out: linear and without damping")
        elif current and block.keyword in NUMBERS:
            _add_property(mesh, current, block)


def _add_property(mesh: FileMesh, material: str, block: KeywordBlock) -> None:
    kind = block.parameters.get("TYPE", "").upper()
    if kind not in ISOTROPIC:
        said = f"*{block.keyword}, TYPE={kind}"
        if block.keyword == "ELASTIC":
            mesh.unread_materials[material] = said
        else:
            mesh.remark(material, f"material {material}: {said} left out: only isotropic is read")
        return
    mesh.materials[material] |= _first_row(block)
    if len({tuple(line.replace(" ", "").split(",")[: len(NUMBERS[block.keyword])]) for line in block.data}) > 1:
        on = "the first line is taken"
        mesh.remark(material, f"material {material}: *{block.keyword} depends on temperature: {on}")


def _first_row(block: KeywordBlock) -> dict[str, float]:
    """The numbers of the first line; one that is left out stays unknown, but the first must be there."""

    def refusal(field: str) -> MeshFileError:
        return block.refuse(f"{field.strip()!r}: must be a number")

    names = NUMBERS[block.keyword]
    fields = (block.data[0] if block.data else "").split(",")[: len(names)]
    given = {name: field for name, field in zip(names, fields, strict=False) if field.strip()}
    if names[0] not in given:
        raise block.refuse(f"must have the number of {names[0].replace('_', ' ')}")
    return {name: float(numbers([field], refusal)[0]) for name, field in given.items()}

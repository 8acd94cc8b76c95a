"""Reduced models of other programs: superelements with their physical and modal coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry.units import UNIT_SYSTEMS
from rom.cyclic.reduced_model import ReducedModel
from rom.errors import MatrixFileError, RomParameterError
from rom.matrix_files.labelled_matrix import FORCE, TRANSFORMATION, DofLabels
from rom.matrix_files.matrix_choice import MatrixChoice
from rom.matrix_files.matrix_file import read_matrix
from rom.matrix_files.matrix_model import read_matrix_pair
from rom.matrix_files.node_sets import SectorNodes, sector_nodes
from rom.matrix_files.node_table import read_dofs
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

LARGEST = 20_000  # coordinates: dense matrices of 3 GB
_SINGULAR = 1e-13


def model_from_superelement(
    choice: MatrixChoice, boundary: BoundaryChoice = AT_TIP
) -> tuple[ReducedModel, tuple[str, ...]]:
    """The reduced model of a superelement, no further reduced.

    The displacement u = T q of the nodes follows from the transformation T; without one each coordinate is a
    displacement of a node, as the dofs say, or a generalised coordinate, as modes are.

    The basis of the model has the displacements of the nodes whose displacements are known. Returns too what was
    completed or found suspicious, one line each.
    """
    found = sector_nodes(choice)
    stiffness, mass, motion, notes = _matrices(choice, found)
    system = UNIT_SYSTEMS[choice.unit]
    energy = system.force * system.length
    basis = _nodal_motion(found, motion)
    _require(choice, found, basis)
    model = ReducedModel(
        mass=mass.toarray() * (system.mass * system.length * system.length),
        stiffness=stiffness.toarray() * energy,
        force_centrifugal=_centrifugal(choice, stiffness.shape[0], energy),
        basis=np.nan_to_num(basis.reshape(-1, basis.shape[2])),
        n_blades=choice.n_blades,
        speed_rpm=float(choice.speed_rpm),
        producer=f"superelement of {stiffness.shape[0]} coordinates, {choice.speed_rpm:g} rpm",
        **_selection(found, basis, boundary),
    )
    _check_mass(choice, model)
    return model, (*notes, *found.notes)


def _selection(found: SectorNodes, basis: NDArray[np.float64], boundary: BoundaryChoice) -> dict[str, Any]:
    """Contact motions, excitation and outputs, by argument of `ReducedModel`."""
    right, left = found.sector.right, found.sector.left
    load = boundary.unit_direction @ basis[_loaded_node(found, basis, boundary)]
    tip = basis[found.sector.node_sets["tip"][0]]
    n = basis.shape[2]
    return {
        "contact_right": (right.frame @ basis[right.nodes]).reshape(-1, n),
        "contact_left": (left.frame @ basis[left.nodes]).reshape(-1, n),
        "contact_position": right.position,
        "contact_area": right.area,
        "contact_frame": right.frame,
        "force_excitation": load,
        "outputs": {"tip": load, **{f"tip_{axis}": tip[k] for k, axis in enumerate("xyz")}},
    }


def _matrices(
    choice: MatrixChoice, found: SectorNodes
) -> tuple[csr_matrix, csr_matrix, tuple[DofLabels, NDArray[np.float64]], tuple[str, ...]]:
    """Both matrices in the units of the file, displacements of dofs (rows, n) in m for unit coordinates, and notes.

    Coordinates that are displacements stay in the unit of the file; only energies and displacements are converted.
    """
    if choice.transformation is None:
        stiffness, mass, labels, notes = read_matrix_pair(choice)
        if labels is None:
            raise MatrixFileError(choice.stiffness, "coordinates without dofs", "a table dofs, or a transformation")
        motion = np.eye(stiffness.shape[0])
    else:
        plain = MatrixChoice(**{**vars(choice), "dofs": None})
        stiffness, mass, _, notes = read_matrix_pair(plain)
        if choice.dofs is None:
            raise MatrixFileError(choice.transformation, "rows without dofs", "a table dofs of its rows")
        labels = read_dofs(choice.dofs)
        motion = read_matrix(choice.transformation, None, TRANSFORMATION, is_symmetric=False).matrix.toarray()
        if motion.shape != (len(labels), stiffness.shape[0]):
            wanted = f"{len(labels)} x {stiffness.shape[0]}: dofs by coordinates"
            raise MatrixFileError(choice.transformation, f"{motion.shape[0]} x {motion.shape[1]} numbers", wanted)
    if stiffness.shape[0] > LARGEST:
        found_text = f"{stiffness.shape[0]} coordinates"
        raise MatrixFileError(choice.stiffness, found_text, f"{LARGEST} at most, or reduced = false")
    return stiffness, mass, (labels, motion * UNIT_SYSTEMS[choice.unit].length), notes


def _nodal_motion(found: SectorNodes, motion: tuple[DofLabels, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Displacements (nodes, 3, n) in the axes of the ring; NaN for nodes without all three."""
    labels, rows = motion
    nodal = np.full((len(found.table.labels), 3, rows.shape[1]), np.nan)
    physical = np.flatnonzero((labels.component >= 1) & (labels.component <= 3) & (labels.node > 0))
    node = found.table.rows_of(labels.node[physical])
    if np.any(node < 0):
        unknown = labels.node[physical][np.argmax(node < 0)]
        raise MatrixFileError(found.table.path, f"no node {unknown}, which the dofs have", "all nodes of the dofs")
    nodal[node, labels.component[physical] - 1] = rows[physical]
    axes = np.tile(np.eye(3), (len(nodal), 1, 1)) if found.table.axes is None else found.table.axes
    return np.einsum("nji,njk->nik", axes @ found.axes.rows.T, nodal)


def _loaded_node(found: SectorNodes, basis: NDArray[np.float64], boundary: BoundaryChoice) -> int:
    if isinstance(boundary.excitation_at, str):
        return int(found.sector.node_sets["tip"][0])
    known = np.flatnonzero(np.isfinite(basis).all(axis=(1, 2)))
    if not len(known):
        raise RomParameterError("excitation", "at", boundary.excitation_at, "must be near a node of the dofs")
    away = found.sector.points[known] - np.asarray(boundary.excitation_at, dtype=float)
    return int(known[np.argmin(np.linalg.norm(away, axis=1))])


def _require(choice: MatrixChoice, found: SectorNodes, basis: NDArray[np.float64]) -> None:
    """Refuse contact nodes and a tip whose displacements are not known."""
    for name in ("contact_right", "contact_left", "tip"):
        nodes = found.sector.node_sets[name]
        unknown = nodes[~np.isfinite(basis[nodes]).all(axis=(1, 2))]
        if len(unknown):
            label = found.table.labels[unknown[0]]
            shown = f"node {label} of {choice.set_name(name)} has no coordinates in the dofs"
            allowed = "three displacements of every contact node and the tip"
            raise MatrixFileError(choice.dofs or choice.stiffness, shown, allowed)


def _centrifugal(choice: MatrixChoice, size: int, factor: float) -> NDArray[np.float64] | None:
    """Generalised centrifugal force (n,) at 1 rad/s of the file, J; None without one."""
    if choice.centrifugal is None:
        return None
    matrix = read_matrix(choice.centrifugal, None, FORCE, is_symmetric=False).matrix
    if matrix.shape not in ((size, 1), (1, size)):
        raise MatrixFileError(choice.centrifugal, f"{matrix.shape[0]} x {matrix.shape[1]} numbers", f"{size} x 1")
    return np.asarray(matrix.toarray().ravel() * factor)


def _check_mass(choice: MatrixChoice, model: ReducedModel) -> None:
    diagonal = np.diag(model.mass)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    lowest = float(np.linalg.eigvalsh(model.mass * np.outer(scale, scale))[0])
    if lowest <= _SINGULAR:
        shown = f"singular or indefinite, smallest eigenvalue {lowest:.2g} with a diagonal of 1"
        raise MatrixFileError(choice.mass, shown, "a positive definite mass")

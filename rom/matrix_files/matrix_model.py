"""The full model of a sector from stiffness and mass of another program.

Displacements of the nodes come first, x, y, z of each node; rotations and generalised coordinates follow, three to a
place, and are interior dofs. A dof without a row is constrained: a node without any is clamped; a single one is kept
as a spring without mass or coupling, which never moves.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from geometry.sector import SectorMesh
from geometry.units import UNIT_SYSTEMS
from rom.errors import MatrixFileError, RomParameterError
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.matrix_files.calculix import SUFFIXES
from rom.matrix_files.labelled_matrix import FORCE, MASS, STIFFNESS, DofLabels, LabelledMatrix
from rom.matrix_files.matrix_choice import MatrixChoice
from rom.matrix_files.matrix_file import read_matrix
from rom.matrix_files.node_sets import SectorNodes, sector_nodes
from rom.matrix_files.node_table import checked_dofs, read_dofs

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_TRANSLATIONS = 3
_RIGID = 1e-2  # force of a rigid translation on a row over its diagonal entry that is suspicious

_INNER = "inner coordinates, such as the incompatible modes of C3D8I"
_ABSENT = ("centrifugal force: the mass coupled to nodes without rows is not in the matrices and is left out",)


@dataclass(frozen=True)
class MatrixModel:
    """A sector made of matrices."""

    full: FullModel  # stiffness, mass and centrifugal force, SI units, in the axes of the ring
    sector: SectorMesh  # its nodes and contact faces; it has no elements
    notes: tuple[str, ...]  # what was completed, left out or found suspicious, one line each


@dataclass(frozen=True)
class Rows:
    """Where the rows of the matrices go: positions (n,) in the full model with `size` dofs."""

    place: NDArray[np.int64]
    size: int
    dofs: DofLabels
    inner: int = 0  # rows of nodes that CalculiX made


def read_matrix_pair(choice: MatrixChoice) -> tuple[csr_matrix, csr_matrix, DofLabels | None, tuple[str, ...]]:
    """Stiffness and mass in the order of rows of the stiffness, the dofs of these rows, and notes.

    Raises MatrixFileError where they do not fit each other.
    """
    stiffness = read_matrix(choice.stiffness, choice.stiffness_name, STIFFNESS)
    mass = read_matrix(choice.mass, choice.mass_name, MASS)
    notes = (*stiffness.notes, *mass.notes)
    labels, m = stiffness.labels, mass.matrix
    if labels is not None and mass.labels is not None and not np.array_equal(labels.pairs, mass.labels.pairs):
        m = _reordered(choice, mass, labels)
    if choice.dofs is not None:
        labels = read_dofs(choice.dofs)
    if m.shape != stiffness.matrix.shape:
        found = f"{m.shape[0]} rows, {os.path.basename(choice.stiffness)} {stiffness.matrix.shape[0]}"
        raise MatrixFileError(choice.mass, found, "two matrices of the same size")
    if labels is not None and len(labels) != m.shape[0]:
        where = choice.stiffness if choice.dofs is None else choice.dofs
        found = f"{len(labels)} dofs for {m.shape[0]} rows"
        raise MatrixFileError(where, found, "one dof for each row of the matrices")
    for path, matrix in ((choice.stiffness, stiffness.matrix), (choice.mass, m)):
        lowest = matrix.diagonal().min()
        if lowest < 0.0:
            raise MatrixFileError(path, f"a diagonal entry of {lowest:.3g}", "0 or more: the matrix of a structure")
    if not m.diagonal().any():
        raise MatrixFileError(choice.mass, "a mass of 0", "a mass above 0")
    return stiffness.matrix, m, None if labels is None else checked_dofs(choice.stiffness, labels), notes


def model_from_matrices(choice: MatrixChoice) -> MatrixModel:
    """The full model of a sector from the files of another program.

    Returns the model, ready for `reduce_sector` with `contact_dofs = "nodal"`.
    """
    found = sector_nodes(choice)
    stiffness, mass, labels, notes = read_matrix_pair(choice)
    rows = _rows(choice, found, labels, stiffness.shape[0])
    n = len(found.sector.points)
    if choice.speed_rpm and np.any(rows.place >= _TRANSLATIONS * n):
        allowed = "must be 0 with rotations or generalised coordinates, whose Coriolis forces are not known"
        raise RomParameterError("model", "speed_rpm", choice.speed_rpm, allowed)
    empty = ~np.asarray(abs(stiffness).sum(axis=1) + abs(mass).sum(axis=1)).ravel().astype(bool)
    absent, held, single = _constrained(rows, found.sector.node_sets["root"], empty)
    _check_boundary(choice, found, np.union1d(held, single // 3))
    full = _full_model(choice, found, rows, (stiffness, mass), (held, single))
    said = f"{len(rows.place)} dofs, {len(held)} clamped nodes, {np.sum(single < 3 * n)} single constraints"
    notes = (*notes, *([f"{empty.sum()} rows without entries are held: constrained dofs"] if empty.any() else []))
    notes = (*notes, *([f"{rows.inner} rows of nodes that the table does not have: {_INNER}"] if rows.inner else []))
    left_out = _ABSENT if len(absent) and choice.centrifugal is None else ()
    return MatrixModel(full, found.sector, (*notes, *found.notes, said, *left_out, *_findings(choice, full, n)))


def _full_model(
    choice: MatrixChoice,
    found: SectorNodes,
    rows: Rows,
    matrices: tuple[csr_matrix, csr_matrix],
    constrained: tuple[NDArray[np.int64], NDArray[np.int64]],
) -> FullModel:
    """The matrices in SI units, the axes of the ring and the places of the full model."""
    held, single = constrained
    system = UNIT_SYSTEMS[choice.unit]
    units = system.force * system.length, system.mass * system.length * system.length
    k, m = (_embedded(matrix, rows, choice.unit, unit) for matrix, unit in zip(matrices, units, strict=True))
    spring = np.zeros(rows.size)
    spring[single] = np.abs(k.diagonal()).mean() or 1.0
    k, m = _turned(_with_diagonal(k, spring), found, rows.size), _turned(m, found, rows.size)
    n = len(found.sector.points)
    positions = np.zeros((rows.size // 3, 3))
    positions[:n] = found.sector.points
    given = choice.centrifugal is not None
    return FullModel(
        stiffness=k,
        mass=m,
        positions=positions,
        vertex_node=np.arange(n),
        fixed=node_dofs(held).ravel(),
        centrifugal=_given_force(choice, found, rows) if given else _spin_force(m, positions),
        element="matrices",
        speed_rpm=float(choice.speed_rpm),
        isotropic_mass=_is_isotropic(m),
    )


def _embedded(matrix: csr_matrix, rows: Rows, unit: str, factor: float) -> csr_matrix:
    """A matrix in the places of the full model, in SI units; `factor`: of an entry of two rotations."""
    from scipy.sparse import coo_matrix

    scale, entries = _scale(unit, rows), matrix.tocoo()
    data = entries.data * scale[entries.row] * scale[entries.col] * factor
    where = rows.place[entries.row], rows.place[entries.col]
    return coo_matrix((data, where), shape=(rows.size, rows.size)).tocsr()


def _reordered(choice: MatrixChoice, mass: LabelledMatrix, labels: DofLabels) -> csr_matrix:
    """The mass with the rows of the stiffness; dofs that it does not have are massless."""
    from scipy.sparse import coo_matrix

    assert mass.labels is not None
    place = {(int(node), int(component)): k for k, (node, component) in enumerate(labels.pairs)}
    try:
        to = np.array([place[int(node), int(component)] for node, component in mass.labels.pairs], dtype=np.int64)
    except KeyError as error:
        node, component = error.args[0]
        found = f"component {component} of node {node} has no row in {os.path.basename(choice.stiffness)}"
        raise MatrixFileError(choice.mass, found, "dofs of the stiffness") from None
    entries = mass.matrix.tocoo()
    shape = len(labels), len(labels)
    return coo_matrix((entries.data, (to[entries.row], to[entries.col])), shape=shape).tocsr()


def _rows(choice: MatrixChoice, found: SectorNodes, labels: DofLabels | None, count: int) -> Rows:
    """Place of each row in the full model."""
    table, n = found.table, len(found.table.labels)
    if labels is None:
        if count != _TRANSLATIONS * n:
            allowed = f"{_TRANSLATIONS * n} rows, three for each of the {n} nodes in their order, or a table dofs"
            raise MatrixFileError(choice.stiffness, f"{count} rows without dofs", allowed)
        labels = DofLabels(np.repeat(table.labels, 3), np.tile([1, 2, 3], n))
    generalised = (labels.component == 0) | (labels.node <= 0)
    row = table.rows_of(labels.node)
    # nodes of incompatible modes are numbered behind those of the deck
    made = np.full(len(row), os.fspath(choice.stiffness).lower().endswith(SUFFIXES))
    made &= (row < 0) & (labels.node > table.labels.max())
    generalised |= made
    unknown = np.flatnonzero((row < 0) & ~generalised)
    if len(unknown):
        shown = f"no node {labels.node[unknown[0]]}, which the matrices have"
        raise MatrixFileError(table.path, shown, "all nodes of the matrices")
    translation = ~generalised & (labels.component <= _TRANSLATIONS)
    others = np.flatnonzero(~translation)
    place = _TRANSLATIONS * row + labels.component - 1
    place[others] = _TRANSLATIONS * n + np.arange(len(others))
    return Rows(place, _TRANSLATIONS * (n + -(-len(others) // 3)), labels, int(made.sum()))


def _scale(unit: str, rows: Rows) -> NDArray[np.float64]:
    """Unit displacement (1 m) of each row in the unit of the file; rotations and generalised coordinates stay."""
    return np.where((rows.dofs.component >= 1) & (rows.dofs.component <= 3), 1.0 / UNIT_SYSTEMS[unit].length, 1.0)


def _constrained(
    rows: Rows, root: NDArray[np.int64], empty: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Nodes without rows, all clamped nodes, and single dofs without a row (of other nodes, or places left over).

    `empty` (n,): rows without entries, as Ansys writes those of constrained dofs; they count as none.
    """
    present = np.zeros(rows.size, dtype=bool)
    present[rows.place[~empty]] = True
    absent = np.asarray(~present.reshape(-1, 3).any(axis=1))
    held = absent.copy()
    held[root] = True
    missing = ~present.reshape(-1, 3) & ~held[:, None]
    return np.flatnonzero(absent), np.flatnonzero(held), np.flatnonzero(missing.ravel())


def _with_diagonal(matrix: csr_matrix, diagonal: NDArray[np.float64]) -> csr_matrix:
    from scipy.sparse import diags

    return (matrix + diags(diagonal)).tocsr() if diagonal.any() else matrix


def _turned(matrix: csr_matrix, found: SectorNodes, size: int) -> csr_matrix:
    """B^T A B with B from displacements in the axes of the ring to those of the rows."""
    from scipy.sparse import block_diag, identity

    n = len(found.table.labels)
    if found.table.axes is None and not found.axes.turned:
        return matrix
    nodal = np.tile(np.eye(3), (n, 1, 1)) if found.table.axes is None else found.table.axes
    blocks = nodal @ found.axes.rows.T
    rest = [identity(size - 3 * n)] if size > 3 * n else []
    change = block_diag([*blocks, *rest], format="csr")
    turned = (change.T @ matrix @ change).tocsr()
    return (0.5 * (turned + turned.T)).tocsr()


def _is_isotropic(mass: csr_matrix) -> bool:
    """Whether every 3 x 3 block of the mass is exactly a number times the identity."""
    from scipy.sparse import identity, kron

    return bool((mass - kron(mass[::3][:, ::3], identity(3), format="csr")).count_nonzero() == 0)


def _spin_force(mass: csr_matrix, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centrifugal force W^T M W x at 1 rad/s with W x = e_x cross x of each node: M (0, y, z) of a usual mass."""
    x, y, z = positions.T
    velocity = mass @ np.column_stack([np.zeros_like(x), z, -y]).ravel()
    _, u, v = velocity.reshape(-1, 3).T
    return np.column_stack([np.zeros_like(x), -v, u]).ravel()


def _given_force(choice: MatrixChoice, found: SectorNodes, rows: Rows) -> NDArray[np.float64]:
    """The centrifugal force of a file, one number for each row of the matrices."""
    assert choice.centrifugal is not None
    matrix = read_matrix(choice.centrifugal, None, FORCE, is_symmetric=False).matrix
    count = len(rows.place)
    if matrix.shape not in ((count, 1), (1, count)):
        raise MatrixFileError(choice.centrifugal, f"{matrix.shape[0]} x {matrix.shape[1]} numbers", f"{count} x 1")
    force = np.zeros(rows.size)
    system = UNIT_SYSTEMS[choice.unit]
    scale = _scale(choice.unit, rows) * system.length * system.force
    force[rows.place] = matrix.toarray().ravel() * scale
    n = len(found.table.labels)
    nodal = np.tile(np.eye(3), (n, 1, 1)) if found.table.axes is None else found.table.axes
    force[: 3 * n] = np.einsum("nji,nj->ni", nodal @ found.axes.rows.T, force[: 3 * n].reshape(n, 3)).ravel()
    return force


def _check_boundary(choice: MatrixChoice, found: SectorNodes, constrained: NDArray[np.int64]) -> None:
    """Contact nodes and tip need all three displacements."""
    for name in ("contact_right", "contact_left", "tip"):
        nodes = found.sector.node_sets[name]
        wrong = nodes[np.isin(nodes, constrained)]
        if len(wrong):
            label = found.table.labels[wrong[0]]
            shown = f"node {label} of {choice.set_name(name)} has constrained displacements or none in the matrices"
            raise MatrixFileError(found.table.path, shown, "nodes with three free displacements")


def _findings(choice: MatrixChoice, full: FullModel, n: int) -> tuple[str, ...]:
    """A warning where rigid translations cause forces nearly everywhere."""
    diagonal = full.stiffness.diagonal()[: 3 * n]
    stiff = np.setdiff1d(np.flatnonzero(diagonal > 0.0), full.fixed)
    rigid = np.zeros((full.n_dofs, 3))
    rigid[: 3 * n] = np.tile(np.eye(3), (n, 1))
    force = np.abs(full.stiffness @ rigid)[stiff].max(axis=1)
    share = float(np.median(force / diagonal[stiff])) if len(stiff) else 0.0
    if share <= _RIGID:
        return ()
    file = os.path.basename(choice.stiffness)
    return (
        f"warning: {file}: rigid translations cause forces of {share:.2g} of the diagonal on most rows: "
        "do rows, dofs and axes belong together?",
    )

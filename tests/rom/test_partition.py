"""Blocks of a matrix at the boundary dofs against T^T A T written out."""

import numpy as np
import pytest
from rom_meshes import patch_block
from scipy.sparse import identity, kron

from rom import BoundaryChoice, Material, assemble
from rom.reduction.boundary_dofs import choose_boundary_dofs
from rom.reduction.substructure import partitioned


@pytest.mark.parametrize("kind", ["nodal", "patch", "mortar"])
def test_the_blocks_are_those_of_the_transformed_matrix(kind):
    sector = patch_block()
    full = assemble(sector, Material(2.1e11, 0.3, 7800.0))
    boundary = choose_boundary_dofs(full, sector, BoundaryChoice(contact_dofs=kind))
    interior = np.setdiff1d(np.arange(len(full.positions)), np.append(boundary.nodes, full.fixed // 3))
    change = identity(len(full.positions)) if boundary.variables is None else boundary.variables
    for matrix, per_node in ((full.stiffness, 3), (full.mass[::3][:, ::3], 1)):
        written_out = kron(change, identity(per_node)).tocsr()
        expected = (written_out.T @ matrix @ written_out).toarray()
        i, b = ((per_node * nodes[:, None] + np.arange(per_node)).ravel() for nodes in (interior, boundary.nodes))
        found = partitioned(matrix.tocsr(), interior, boundary, per_node)
        scale = np.abs(expected).max()
        for block, (rows, columns) in zip(found, ((i, i), (i, b), (b, b)), strict=True):
            np.testing.assert_allclose(block.toarray(), expected[np.ix_(rows, columns)], atol=1e-13 * scale)
        assert (found[0] != found[0].T).nnz == 0
        assert found[0].has_canonical_format
    force = full.centrifugal
    moved = kron(change, identity(3)).tocsr()
    np.testing.assert_allclose(boundary.transform_force(force), moved.T @ force, atol=1e-12)
    values = np.random.default_rng(0).standard_normal((full.n_dofs, 2))
    np.testing.assert_allclose(boundary.mesh_displacements(values.copy()), moved @ values, atol=1e-12)

"""The reduced model under cyclic symmetry: modes, receptance, natural frequencies by nodal diameter."""

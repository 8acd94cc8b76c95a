"""Stiffness and mass matrices of other programs: files, tables of nodes and dofs, and the models made of them."""

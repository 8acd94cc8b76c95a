"""The blade, its shroud and its disk from their parameters: planform, layouts, quadrilaterals, hexahedra."""

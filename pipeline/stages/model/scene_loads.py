"""Loads and outputs of a scene as vectors on the full model."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.loads_section import NodalTable, Output, force_table, unit_vector
from pipeline.stages.model.mesh_temperature import points_of, temperature_rise
from pipeline.stages.model.model_files import is_joined

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.elements import ElementSides
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene
    from rom.cyclic.reduced_model import ReducedModel
    from rom.finite_elements.full_model import FullModel
    from rom.finite_elements.material import Materials
    from rom.reduction.boundary_dofs import LoadVectors


FARTHEST = 0.01  # distance of a point of a file from the nearest node, of the size of the mesh
Vector = NDArray[Any]


def has_load_vectors(scene: Scene) -> bool:
    """Whether a scene has loads or outputs beside the force at one point and the speed."""
    load = scene.load
    static = load.force or load.pressure or load.temperature
    return bool(scene.excitation.load or static or any(not output.of_model for output in scene.output))


def scene_loads(
    scene: Scene, sector: SectorMesh, materials: Materials | None
) -> Callable[[FullModel], LoadVectors] | None:
    """Loads and outputs of a scene as a function of its full model; None where it has none."""
    if not has_load_vectors(scene):
        return None
    return lambda full: _Loads(scene, sector, materials, full).vectors()


def with_static_loads(scene: Scene, sector: SectorMesh, materials: Materials, full: FullModel) -> FullModel:
    """A model at rest whose load at the speed of a scene holds its static forces and pressures too.

    They do not grow with the speed: at 1 rad/s they count divided by its square.
    """
    from rom.units import angular_speed

    force = _Loads(scene, sector, materials, full).mechanical()
    if force is None:
        return full
    return replace(full, centrifugal=full.centrifugal + force / angular_speed(scene.load.speed_rpm) ** 2)


def static_support(scene: Scene, sector: SectorMesh, full: FullModel) -> tuple[csr_matrix | None, csr_matrix | None]:
    """Motions that the cut faces of a disk leave in a static state, springs on bodies that contacts alone hold."""
    from rom.cyclic_sector.cyclic_faces import cyclic_faces
    from rom.cyclic_sector.cyclic_modes import static_motion
    from rom.reduction.floating_bodies import stuck_springs

    motion = static_motion(full, cyclic_faces(full, sector)) if is_joined(sector) else None
    return motion, stuck_springs(full, sector, scene.rom.contact_dofs)


def with_modal_excitation(scene: Scene, model: ReducedModel) -> ReducedModel:
    """The reduced model with the modal forces of a scene."""
    from rom.reduction.modal_forces import with_modal_forces

    loads = scene.excitation.load
    by_mode: dict[int, dict[int, complex]] = {}
    for load in loads:
        if load.mode is not None:
            modes = by_mode.setdefault(load.harmonic, {})
            modes[load.mode] = modes.get(load.mode, 0.0) + cmath.rect(load.amplitude, math.radians(load.phase))
    beside = {load.harmonic for load in loads if load.mode is None}
    for harmonic, modes in by_mode.items():
        model = with_modal_forces(model, modes, harmonic=harmonic, added=harmonic in beside)
    if loads and 1 not in beside | set(by_mode):  # the fundamental is not excited
        model = replace(model, force_excitation=np.zeros(model.size))
    return model


class _Loads:
    """Vectors of one scene on one full model."""

    def __init__(self, scene: Scene, sector: SectorMesh, materials: Materials | None, full: FullModel) -> None:
        self.scene, self.sector, self.materials, self.full = scene, sector, materials, full

    def vectors(self) -> LoadVectors:
        """All of them."""
        from rom.reduction.boundary_dofs import LoadVectors

        excitation: dict[int, Vector] = {}
        for number, load in enumerate(self.scene.excitation.load):
            if load.mode is not None:
                continue
            turn = cmath.rect(load.amplitude, math.radians(load.phase)) if load.phase else load.amplitude
            direction = self.scene.excitation.direction if load.direction is None else load.direction
            force = turn * self._force(load, f"load[{number}]", direction)
            excitation[load.harmonic] = excitation.get(load.harmonic, 0.0) + force
        outputs: dict[str, Vector] = {}
        for output in self.scene.output:
            outputs |= self._rows(output)
        return LoadVectors(excitation, self._static(), outputs)

    def _force(self, load: Any, key: str, direction: Any) -> Vector:
        """The force of 1 N on a point or a set, of 1 Pa on a surface, or of a file."""
        from rom.finite_elements.loads import nodal_force

        if getattr(load, "surface", None) is not None:
            return self._pressure("excitation", load.surface)
        if load.file is not None:
            table = force_table(load.file, self.scene.contents)
            return nodal_force(self.full, self._nodes_of(table), table.values)
        nodes = self._point(load.at) if load.at is not None else self._set("excitation", key, load.set)
        share = 1.0 / len(nodes) if load.share == "total" else 1.0
        return nodal_force(self.full, nodes, share * np.array(unit_vector(direction)))

    def mechanical(self) -> Vector | None:
        """Static forces and pressures together; None without any."""
        load = self.scene.load
        parts = [
            force.force * self._force(force, f"force[{k}]", force.direction) for k, force in enumerate(load.force)
        ]
        parts += [item.pressure * self._pressure("load", item.surface) for item in load.pressure]
        return np.sum(parts, axis=0).real if parts else None

    def _static(self) -> Vector | None:
        """The static force beside the equilibrium in rotation, which holds the mechanical loads."""
        in_equilibrium = self.materials is not None and self.scene.load.speed_rpm != 0.0
        force = None if in_equilibrium else self.mechanical()
        if self.scene.load.temperature is None:
            return force
        thermal = self._thermal()
        return thermal if force is None else force + thermal

    def _thermal(self) -> Vector:
        from rom.errors import RomParameterError
        from rom.finite_elements.loads import thermal_force
        from rom.finite_elements.material import HotMaterials

        if self.materials is None:
            raise RomParameterError("load", "temperature", "a field", "nothing beside [model], which has no elements")
        given: Any = self.materials.values() if isinstance(self.materials, dict) else [self.materials]
        if not isinstance(self.materials, HotMaterials) and not any(np.any(each.expansion) for each in given):
            raise RomParameterError(
                "material", "expansion", 0.0, "the expansion coefficient, 1/K, for load.temperature"
            )
        rise = temperature_rise(self.scene, self.sector)
        assert rise is not None
        return thermal_force(self.full, self.sector, self.materials, rise, self._equilibrium())

    def _equilibrium(self) -> Vector | None:
        """Static displacement at speed, about which the blade expands; None at rest."""
        from rom.finite_elements.rotation import centrifugal_displacement
        from rom.units import angular_speed

        full = self.full
        if full.speed_rpm == 0.0:
            return None
        held = static_support(self.scene, self.sector, full)
        displacement: Vector = angular_speed(full.speed_rpm) ** 2 * centrifugal_displacement(full, *held)
        return displacement

    def _rows(self, output: Output) -> dict[str, Vector]:
        """The rows of an output: one, or three of a vector."""
        from rom.finite_elements.loads import nodal_force, strain_row

        if output.of_model:
            return {}
        if output.quantity == "strain":
            assert not isinstance(output.at, str | None)
            direction = unit_vector(output.direction)  # type: ignore[arg-type]
            return {output.name: strain_row(self.full, self.sector, output.at, direction)}
        at = output.at
        nodes = self._point(at) if at is not None else self._set("output", output.name, str(output.set))
        if output.direction != "magnitude":
            direction = unit_vector(output.direction)
            return {output.name: nodal_force(self.full, nodes, np.array(direction) / len(nodes))}
        axes = zip("xyz", np.eye(3), strict=True)
        return {f"{output.name}_{axis}": nodal_force(self.full, nodes, row / len(nodes)) for axis, row in axes}

    def _point(self, at: Any) -> NDArray[np.int64]:
        from rom.finite_elements.loads import nearest_vertices

        if isinstance(at, str):
            return self.full.vertex_node[self.sector.node_sets["tip"][:1]]
        return nearest_vertices(self.full, [at])[0]

    def _set(self, table: str, key: str, name: str) -> NDArray[np.int64]:
        from rom.errors import RomParameterError

        sets, given = self.sector.node_sets, name
        name = self._in_the_case_of_the_file(given)
        if name not in sets and name in self.sector.surfaces:
            return self.full.vertex_node[self.sector.surfaces[name].nodes(self.sector.blocks)]
        if name not in sets or not len(sets[name]):
            raise RomParameterError(table, f"{key}.set", given, f"a node set of the mesh: {', '.join(sorted(sets))}")
        return self.full.vertex_node[sets[name]]

    def _pressure(self, table: str, name: str) -> Vector:
        from rom.errors import RomParameterError
        from rom.finite_elements.loads import pressure_force

        surface = self._surface(name)
        if self.materials is None or surface is None or not len(surface):
            known = sorted({*self.sector.surfaces, *self.sector.node_sets})
            allowed = f"a surface of the mesh: {', '.join(known)}" if self.materials is not None else "no pressure: "
            allowed += "" if self.materials is not None else "[model] has no elements"
            raise RomParameterError(table, "surface", name, allowed)
        return pressure_force(self.full, self.sector, surface, 1.0)

    def _surface(self, name: str) -> ElementSides | None:
        """A surface by its name, or the outer sides between the nodes of a set."""
        from geometry.elements import sides_on

        name = self._in_the_case_of_the_file(name)
        if name in self.sector.surfaces:
            return self.sector.surfaces[name]
        if name in self.sector.node_sets:
            return sides_on(self.sector.blocks, self.sector.node_sets[name])
        return None

    def _in_the_case_of_the_file(self, name: str) -> str:
        """The name of a set or surface where it differs from a single one by upper and lower case only."""
        known = {*self.sector.node_sets, *self.sector.surfaces}
        alike = [each for each in known if each.lower() == name.lower()]
        return alike[0] if name not in known and len(alike) == 1 else name

    def _nodes_of(self, table: NodalTable) -> NDArray[np.int64]:
        """Nodes of the full model of the rows of a table."""
        from scipy.spatial import cKDTree

        from rom.errors import RomParameterError

        if table.positions is None:
            return self.full.vertex_node[points_of(self.sector, table)]
        distance, nodes = cKDTree(self.full.positions).query(table.positions)
        farthest = FARTHEST * float(np.ptp(self.full.positions, axis=0).max())
        if distance.max() > farthest:
            row = int(np.argmax(distance))
            position = [float(value) for value in table.positions[row]]
            raise RomParameterError(
                "loads",
                "file",
                table.path,
                f"positions on nodes (m); {position} is {distance[row]:.3g} m from the nearest",
            )
        return np.asarray(nodes, dtype=np.int64)

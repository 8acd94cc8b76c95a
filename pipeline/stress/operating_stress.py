"""Stress on the mesh at the worst motion of a curve, written as the files of one store entry.

VTU files (VTK's XML format) hold it at the nodes; arrays are in base64, uncompressed, so equal fields give equal
files.
"""

from __future__ import annotations

import base64
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.contact_section import mean_of
from pipeline.scene.loads_section import Excitation
from pipeline.scene.material_section import Fatigue, Stress
from pipeline.scene.response_section import Response
from pipeline.stages.curve.curve_file import BRANCHES, contacts_of_curve, modes_of_curve, section_from_attributes
from pipeline.stages.model.build_reduced_model import at_speed, boundary_choice
from pipeline.stages.model.mesh_temperature import temperature_of_mesh, temperature_rise
from pipeline.stages.model.model_files import is_joined
from pipeline.stages.model.scene_materials import scene_materials
from pipeline.stages.scene_to_solver import InterfaceContact, section_excitation, touching_sector

if TYPE_CHECKING:
    import h5py
    import numpy as np
    from numpy.typing import NDArray

    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene
    from rom.finite_elements.material import Materials
    from rom.stress.operating_stress import OperatingStress


_TYPES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8", "f4": "Float32"}


def write_vtu(
    path: Path,
    points: NDArray[np.float64],
    cells: Sequence[tuple[int, NDArray[np.int64]]],
    fields: Mapping[str, NDArray[Any]],
) -> None:
    """Write a mesh with fields at its nodes.

    Shapes: `points` (n, 3), `cells` (E, b), `fields` (n,).
    """
    connectivity = np.concatenate([nodes.ravel() for _, nodes in cells]).astype("i8")
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for _, nodes in cells])
    kinds = np.concatenate([np.full(len(nodes), kind, dtype="u1") for kind, nodes in cells])
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{order}" header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(sizes)}">',
        *_section("Points", [("points", np.asarray(points, dtype="f8"))]),
        *_section(
            "Cells", [("connectivity", connectivity), ("offsets", np.cumsum(sizes).astype("i8")), ("types", kinds)]
        ),
        *_section("PointData", fields.items()),
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
        "",
    ]
    path.write_text("\n".join(lines), encoding="ascii")


def _section(name: str, arrays: Iterable[tuple[str, NDArray[Any]]]) -> list[str]:
    return [f"<{name}>", *(_array(*item) for item in arrays), f"</{name}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    kind = "i8" if values.dtype.kind == "i" else values.dtype.str[1:]
    content = np.ascontiguousarray(values, dtype=kind).tobytes()
    data = base64.b64encode(np.uint64(len(content)).tobytes() + content).decode("ascii")
    size = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{_TYPES[kind]}" Name={quoteattr(name)} NumberOfComponents="{size}" format="binary">'
        f"{data}</DataArray>"
    )


FACTS = "stress.json"
CYCLES = "cycles.npy"  # mean and amplitude, Pa, margin and whether it is singular, of each place on the surface


@dataclass(frozen=True)
class OperatingPoint:
    """The solved point that the stress is of."""

    # `frequency_hz`, `amplitude_m`: of the point
    frequency_hz: float
    amplitude_m: float
    motion: str  # "periodic", "quasi-periodic" or, where no motion that persists is known, "peak"
    branch: int  # 0: main branch; k: detached branch k
    worst_amplitude_m: float  # amplitude of the worst motion; nan where it is not known
    contact_force: NDArray[np.complex128]  # (H+1, n_c, 3), contact forces, N

    @property
    def notes(self) -> list[str]:
        """What the reader of the numbers has to know of the point."""
        ratio = self.worst_amplitude_m / self.amplitude_m
        if self.motion == "peak" and math.isfinite(ratio):
            return [
                "the worst motion is no solution of the curve: the stress is that of the peak of the main branch, "
                f"of whose amplitude the motion has {ratio:.3g} times"
            ]
        if self.motion == "peak":
            return ["no motion that persists is known: the stress is that of the peak of the main branch"]
        if self.motion != "periodic":
            return [
                f"the worst motion is {self.motion}; the stress is that of the periodic solution from which it "
                f"departs, whose amplitude the motion exceeds by the factor {ratio:.3g}"
            ]
        return []


def operating_point(file: h5py.File) -> OperatingPoint | None:
    """The worst motion of a stored curve, or its peak where that is not known; None where there is neither."""
    attributes = file.attrs
    branch, index = int(attributes.get("worst_branch", -1)), int(attributes.get("worst_index", -1))
    motion, worst = str(attributes.get("worst_motion", "")), float(attributes.get("worst_amplitude_m", math.nan))
    group = file if branch == 0 else file.get(f"{BRANCHES}/{branch}")
    if group is None or branch < 0 or not 0 <= index < len(group["frequency_hz"]) or not math.isfinite(worst):
        branch, index, motion, group = 0, int(attributes["peak_index"]), "peak", file
        if index < 0:
            return None
    return OperatingPoint(
        float(group["frequency_hz"][index]),
        float(group["amplitude_m"][index]),
        motion,
        branch,
        worst,
        group["contact_force"][index],
    )


def make_operating_stress(
    folder: Path, name: str, curve: Path, rom: Path, sector_file: Path, full_file: Path, scene: Scene
) -> None:
    """Write `<name>.vtu`, the fields on the mesh, and `stress.json`, their largest values and hot spots."""
    import h5py

    from rom.cyclic_sector.cyclic_faces import cyclic_faces
    from rom.files.full_model_file import load_full_model
    from rom.files.reduced_model_file import read_reduced_model
    from rom.files.sector_file import load_sector
    from rom.stress.mesh_motion import SolvedPoint
    from rom.stress.operating_stress import operating_stress

    with h5py.File(curve, "r") as file:
        response = section_from_attributes(Response, file.attrs)
        excitation, attributes = section_from_attributes(Excitation, file.attrs), dict(file.attrs)
        contacts = contacts_of_curve(file)
        point = operating_point(file)
    if point is None:
        raise ValueError("the curve has no solved point")
    settings = scene.stress or Stress()
    sector = touching_sector(scene, load_sector(sector_file))
    materials = scene_materials(scene, sector_file, sector)
    full = at_speed(load_full_model(full_file), sector, scene, materials)
    model = read_reduced_model(rom)
    modal = modes_of_curve(model, attributes)
    wave = section_excitation(excitation)
    omega, phase = 2.0 * math.pi * point.frequency_hz, modal.phase(excitation.engine_order)
    stress = operating_stress(
        full,
        sector,
        materials,
        (model, modal),
        boundary_choice(scene, sector, materials),
        SolvedPoint(omega, phase, wave.force, point.contact_force, wave.factors),
        large_displacements=scene.load.equilibrium == "nonlinear",
        temperature=temperature_rise(scene, sector),
        check=settings.check,
        faces=cyclic_faces(full, sector) if is_joined(sector) else None,
    )
    heat = _temperature_of_places(scene, sector, stress)
    limits = _margins(stress, scene.fatigue, heat)
    _write_fields(folder / f"{name}.vtu", stress, limits)
    if limits:
        columns = stress.cycle.mean, stress.cycle.amplitude, limits["margin"], ~stress.surroundings.regular
        np.save(folder / CYCLES, np.column_stack(columns)[stress.surface])
    found = _facts(stress, limits, point, settings.hot_spots, scene.fatigue)
    _add_to_spots(found, stress, materials, heat)
    found["notes"] += [*_notes(contacts, response, stress), *_beyond(scene.fatigue, heat)]
    (folder / FACTS).write_text(json.dumps(found, allow_nan=False), encoding="utf-8")


def _temperature_of_places(scene: Scene, sector: SectorMesh, stress: OperatingStress) -> NDArray[np.float64] | None:
    """Temperatures of the places (s,), of the nearest points of the mesh; None without a field."""
    import numpy as np
    from scipy.spatial import cKDTree

    if scene.load.temperature is None:
        return None
    field = np.broadcast_to(temperature_of_mesh(scene, sector), len(sector.points))
    return np.asarray(field[cKDTree(sector.points).query(stress.positions)[1]])


def _beyond(fatigue: Fatigue | None, temperature: NDArray[np.float64] | None) -> list[str]:
    """A note where the limits are not given at the temperatures of some places, which have no margin."""
    if fatigue is None or not fatigue.at or temperature is None:
        return []
    low, *_, high = fatigue.temperatures
    outside = temperature[(temperature < low) | (temperature > high)]
    if not len(outside):
        return []
    share = f"{100.0 * len(outside) / len(temperature):.3g} % of the nodes"
    span = f"at {outside.min():g} to {outside.max():g}: [[fatigue.at]] has limits from {low:g} to {high:g}"
    return [f"no margin at {share}, {span}"]


def _margins(
    stress: OperatingStress, fatigue: Fatigue | None, temperature: NDArray[np.float64] | None
) -> dict[str, NDArray[np.float64]]:
    """Margins at the places by name; empty without any, nan where a material has no limits at its temperature."""
    import numpy as np

    from rom.stress.fatigue import FatigueLimits

    if fatigue is None:
        return {}
    count = len(stress.material)
    found = {"margin": np.full(count, np.nan), "amplitude_margin": np.full(count, np.nan)}
    cycle = stress.cycle
    for number, material in enumerate(stress.materials):
        at = stress.material == number
        grid = fatigue.temperatures if temperature is not None else [fatigue.temperature]
        rows = [limits for where in grid if (limits := fatigue.limits_of(material, where)) is not None]
        if not rows:
            continue
        if len(rows) > 1 and temperature is not None:
            columns = [
                None if None in column else np.array(column, dtype=float) for column in zip(*rows, strict=True)
            ]
            beyond: dict[str, float] = {"left": np.nan, "right": np.nan}
            values = [None if c is None else np.interp(temperature[at], grid, c, **beyond) for c in columns]
            law = FatigueLimits(*values)  # type: ignore[arg-type]
        else:
            law = FatigueLimits(*rows[0])
        found["margin"][at] = law.margin(cycle.amplitude[at], cycle.mean[at])
        found["amplitude_margin"][at] = law.amplitude_margin(cycle.amplitude[at], cycle.mean[at])
    return {} if np.isnan(found["margin"]).all() else found


def _write_fields(path: Path, stress: OperatingStress, margins: dict[str, NDArray[np.float64]]) -> None:
    """The fields as VTU; places that no element of the file uses are left out."""
    import numpy as np

    from rom.stress.stress_recovery import von_mises

    used = np.unique(np.concatenate([nodes.ravel() for _, nodes in stress.cells]))
    cells = [(kind, np.searchsorted(used, nodes)) for kind, nodes in stress.cells]
    fields: dict[str, Any] = {
        "von_mises_amplitude_pa": stress.cycle.amplitude,
        "mean_stress_pa": stress.cycle.mean,
        "largest_von_mises_pa": stress.cycle.largest,
        "von_mises_static_pa": von_mises(stress.harmonics[0].real),
        **{name: np.minimum(values, 1e6) for name, values in margins.items()},
        "spread_pa": stress.spread,
        "static_spread_pa": stress.static_spread,
        "singular": stress.surroundings.cause.astype("i8"),
        "material": stress.material.astype("i8"),
        "stress_0_pa": stress.harmonics[0].real,
        "displacement_0_m": stress.displacement[0].real,
    }
    for h in range(1, len(stress.harmonics)):
        for part, of in (("real", np.real), ("imag", np.imag)):
            fields[f"stress_{h}_{part}_pa"] = of(stress.harmonics[h])
            fields[f"displacement_{h}_{part}_m"] = of(stress.displacement[h])
    write_vtu(path, stress.positions[used], cells, {name: values[used] for name, values in fields.items()})


def _facts(
    stress: OperatingStress,
    margins: dict[str, NDArray[np.float64]],
    point: OperatingPoint,
    count: int,
    fatigue: Fatigue | None,
) -> dict[str, Any]:
    """The numbers of the summary."""
    import numpy as np

    from rom.stress.hot_spots import hot_spots

    cycle, regular = stress.cycle, stress.surroundings.regular
    ranking = 1.0 / margins["margin"] if margins else cycle.amplitude
    listed = [
        [
            _spot(stress, margins, place)
            for place in hot_spots(ranking, stress.positions, stress.surroundings.size, chosen, count)
        ]
        for chosen in (regular, ~regular)
    ]
    largest = float(cycle.amplitude[regular].max(initial=0.0))
    least = {name: float(np.nanmin(field[regular], initial=np.inf)) for name, field in margins.items()}
    return {
        "frequency_hz": point.frequency_hz,
        "amplitude_m": point.amplitude_m,
        "motion": point.motion,
        "branch": point.branch,
        "harmonics": len(stress.harmonics) - 1,
        "largest_amplitude_pa": largest,
        "largest_mean_pa": float(cycle.mean[regular].max(initial=0.0)),
        **{f"least_{name}": None for name in ("margin", "amplitude_margin")},
        **{f"least_{name}": value for name, value in least.items() if math.isfinite(value)},
        "required_margin": fatigue.factor if fatigue is not None and margins else None,
        "expansion_error": stress.expansion_error,
        "model_error": stress.model_error if math.isfinite(stress.model_error) else None,
        "hot_spots": listed[0],
        "singular_spots": listed[1],
        "notes": point.notes,
    }


def _spot(stress: OperatingStress, margins: dict[str, NDArray[np.float64]], place: int) -> dict[str, Any]:
    """One hot spot."""
    cause = int(stress.surroundings.cause[place])
    values = {name: float(field[place]) for name, field in margins.items()}
    return {
        "position_m": [float(x) for x in stress.positions[place]],
        "amplitude_pa": float(stress.cycle.amplitude[place]),
        "mean_pa": float(stress.cycle.mean[place]),
        "largest_pa": float(stress.cycle.largest[place]),
        "spread_pa": float(stress.spread[place]),
        "mean_spread_pa": float(stress.static_spread[place]),
        "margin": None,
        "amplitude_margin": None,
        **{name: value if math.isfinite(value) else None for name, value in values.items()},
        "singular": None if cause < 0 else stress.surroundings.causes[cause],
        "material": stress.materials[int(stress.material[place])],
    }


def _add_to_spots(
    found: dict[str, Any], stress: OperatingStress, materials: Materials, temperature: NDArray[np.float64] | None
) -> None:
    """Temperature and resolved shear stress of the hot spots, where there are such."""
    from scipy.spatial import cKDTree

    from rom.stress.resolved_shear import octahedral_shear, slip_axes

    tree = cKDTree(stress.positions)
    for number, spot in enumerate([*found["hot_spots"], *found["singular_spots"]], start=1):
        place = tree.query(spot["position_m"])[1]
        spot["temperature"] = None if temperature is None else float(temperature[place])
        axes = slip_axes(materials, spot["material"])
        if axes is None:
            continue
        amplitude, mean = octahedral_shear(stress.harmonics[:, place], axes)
        spot["resolved_shear_amplitude_pa"], spot["resolved_shear_mean_pa"] = amplitude, mean
        if number == 1:
            sizes = f"amplitude {amplitude / 1e6:.4g} MPa, mean {mean / 1e6:.4g} MPa"
            found["notes"].append(f"hot spot 1: resolved shear stress of the octahedral slip system: {sizes}")


def _notes(contacts: Sequence[InterfaceContact], response: Response, stress: OperatingStress) -> list[str]:
    """What the stress leaves out."""
    notes = []
    if any(np.any(mean_of(each.contact.preload)) for each in contacts):
        notes.append("contact.preload is in equilibrium already: the stress that it causes is not included")
    if response.method == "static-first":
        notes.append("static-first does not balance the mean contact forces, from which the mean stress follows")
    return notes

"""Rows of the page's tables: response curves, natural frequencies, blade and mesh, matrices, contact, loads, time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import sweep_keys
from pipeline.report.report_source import ReportSource
from pipeline.results.tables import (
    amplitude_scale,
    bare_value,
    branch_remarks,
    has_static_load,
    is_sampled,
    static_said,
    truncation_cell,
)
from pipeline.results.worst import (
    END_MARK,
    branch_said,
    end_said,
    open_remarks,
    peak_is_unstable,
    seen_remarks,
    share,
    worst_cells,
)
from pipeline.scene.contact_section import PER_NODE, Contact
from pipeline.scene.geometry_parameters import airfoil_of, geometry_parameters
from pipeline.scene.labels import prefixed, quantity, value_label
from pipeline.scene.schema import Scene
from pipeline.stages.model.build_mesh import SECTOR
from pipeline.stages.model.model_chain import BuiltModel
from pipeline.stages.model.scene_materials import elements_by_kind, materials_of_file, mean_size, own_findings
from pipeline.stages.stage import Stage
from pipeline.store.output_folder import relative_path

if TYPE_CHECKING:
    from geometry.sector import ContactFace, SectorMesh
    from pipeline.scene.schema import Scene
    from pipeline.stages.curve.curve_summary import CurveSummary
    from pipeline.stages.curve.respond import CurveResult
    from rom.cyclic.reduced_model import ReducedModel


Rows = list[tuple[str, str]]


def load_rows(scene: Scene) -> Rows:
    """The excitation with its harmonics and loads, and the static loads beside the speed."""
    wave, load = scene.excitation, scene.load
    rows = [("excitation", f"{wave.force:g} N, engine order {wave.engine_order}")]
    for harmonic in wave.harmonic:
        order = wave.engine_order * harmonic.order
        said = f"{harmonic.amplitude:g} of it, phase {harmonic.phase:g}°"
        rows.append((f"harmonic {harmonic.order} of the excitation, engine order {order}", said))
    rows += [("excitation acts", _excited(item)) for item in wave.load]
    rows += [("static force", f"{item.force:g} N, {_place(item)}") for item in load.force if item.file is None]
    rows += [("static force", f"{item.force:g} times {item.file}") for item in load.force if item.file is not None]
    rows += [("static pressure", f"{item.pressure:g} Pa on {item.surface}") for item in load.pressure]
    if load.temperature is not None:
        field = load.temperature
        found = f"{field.uniform:g}" if field.uniform is not None else str(field.file)
        found = "of the mesh file" if field.of_mesh else found
        if field.linear is not None:
            found = f"{field.linear[0]:g} at the innermost, {field.linear[1]:g} at the outermost radius"
        factor = f", {load.temperature_factor:g} times above it" if load.temperature_factor != 1.0 else ""
        rows.append(("temperature", f"{found}, free of thermal stress at {field.reference:g}{factor}"))
    return rows


def output_rows(curves: Sequence[CurveResult]) -> Rows:
    """The largest value of every further output over all curves, its frequency and its curve."""
    highest: dict[str, tuple[float, float, int, str]] = {}
    for number, curve in enumerate(curves):
        units = {output.name: output.unit for output in curve.member.scene.output}
        for item in curve.facts.outputs if curve.facts is not None else ():
            value, name = item["peak_amplitude"], item["name"]
            if value is not None and value >= highest.get(name, (-1.0, 0.0, 0, ""))[0]:
                highest[name] = value, item["peak_frequency_hz"], number, units.get(name, "m")
    return [(name, _said(*found, many=len(curves) > 1)) for name, found in highest.items()]


def _said(value: float, frequency_hz: float, curve: int, unit: str, *, many: bool) -> str:
    factor, shown = prefixed(value, "m") if unit == "m" else (1e6, "µm/m")
    return f"{value * factor:.4g} {shown} at {frequency_hz:.6g} Hz" + (f", curve {curve}" if many else "")


def _excited(item: Any) -> str:
    parts = [f"{item.amplitude:g} {_unit(item)} per N, {_place(item)}"]
    parts += [f"phase {item.phase:g}°"] * bool(item.phase) + [f"harmonic {item.harmonic}"] * (item.harmonic > 1)
    return ", ".join(parts)


def _unit(item: Any) -> str:
    return "Pa" if item.surface is not None else "N/√kg" if item.mode is not None else "N"


def _place(item: Any) -> str:
    if getattr(item, "mode", None) is not None:
        return f"mode {item.mode}"
    if getattr(item, "surface", None) is not None:
        return f"on {item.surface}"
    if item.file is not None:
        return str(item.file)
    if item.set is not None:
        return f"on {item.set}" + (" (each node)" if item.share == "each" else "")
    return "at the tip" if item.at == "tip" else f"at {list(item.at)} m"


def matrix_rows(scene: Scene) -> list[tuple[str, str]]:
    """The files and what is said of them."""
    model = scene.model
    assert model is not None
    axis = model.axis if isinstance(model.axis, str) else ", ".join(f"{value:g}" for value in model.axis)
    return [
        ("blades of the ring", str(model.n_blades)),
        *((name, Path(file).name) for name, file in model.files.items()),
        ("unit, engine axis in the files", f"{model.unit}, {axis}"),
        ("speed that the stiffness holds at", f"{model.speed_rpm:g} rev/min"),
        ("speed", f"{scene.load.speed_rpm:g} rev/min"),
    ]


def model_rows(model: BuiltModel) -> list[tuple[str, str]]:
    """Sizes of the reduced model and what was found in the files."""
    facts = model.facts
    modes = "of the superelement" if facts["modes"] is None else str(facts["modes"])
    return [
        ("degrees of freedom", str(facts["dofs"])),
        *(("found in the files", line) for line in facts.get("notes", ())),
        ("reduced degrees of freedom", str(facts["reduced_dofs"])),
        ("fixed-interface modes", modes),
    ]


def nodal_contact_rows(reduced: ReducedModel, scene: Scene) -> list[tuple[str, str]]:
    """The contact nodes, their law and the excitation."""
    area = 0.0 if reduced.contact_area is None else float(reduced.contact_area.sum())
    return [
        ("contact nodes", f"{reduced.n_contacts} pairs of nodes"),
        ("area of a face", f"{1e6 * area:.3g} mm²"),
        *_interface_rows(scene, reduced.interfaces),
        *load_rows(scene),
    ]


def _interface_rows(scene: Scene, interfaces: Mapping[str, int]) -> list[tuple[str, str]]:
    """Stiffness, friction and interference of the contact interfaces, a row for each where several touch."""
    chosen = scene.contact.interfaces or tuple(interfaces)
    said = {name: _contact_said(scene.contact_of(name)) for name in interfaces if name in chosen}
    laws = {name: f"law: {scene.contact_of(name).law.replace('_', ' ')}" for name in said}
    if len(said) == 1:
        ((stiffness, friction, interference, _),), (law,) = said.values(), laws.values()
        shown = friction.removeprefix(quantity("contact.friction").symbol).strip()
        return [
            ("stiffness of the whole face", stiffness),
            ("friction", f"{shown}, {law}"),
            ("interference", interference),
        ]
    alike = len(set(laws.values())) == 1
    rows = [
        (f"interface {n}", ", ".join(filter(None, (f"{interfaces[n]} pairs of nodes", *s, laws[n] * (not alike)))))
        for n, s in said.items()
    ]
    return [*rows, *([("friction", next(iter(laws.values())))] if alike else [])]


def _contact_said(contact: Contact) -> tuple[str, str, str, str]:
    """Stiffness, friction, interference and preload of a face; the last empty without one."""
    said = {key: value_label(f"contact.{key}", getattr(contact, key)) for key in PER_NODE}
    stiffness = f"{said['normal_stiffness']}, {said['tangential_stiffness']}"
    return stiffness, said["friction"], said["interference"], said["preload"] * bool(contact.preload)


SHOWN_FREQUENCIES = 6


@dataclass(frozen=True)
class Cell:
    """Text of a cell, and its number as in summary.json ("" where there is none)."""

    text: str
    value: str = ""
    name: str = ""  # of what has a number in the table of curves


@dataclass(frozen=True)
class CurveTable:
    """The response curves: headings, and number, cells and notes of each."""

    headings: tuple[str, ...]
    sampled: bool  # whether a curve is sampled
    rows: tuple[tuple[int, tuple[Cell, ...], tuple[str, ...]], ...]


@dataclass(frozen=True)
class FrequencyTable:
    """Natural frequencies of one reduced model and contact stiffness, a row for each contact condition."""

    heading: str
    modes: int
    rows: tuple[tuple[str, tuple[Cell, ...]], ...]


def curve_table(source: ReportSource, shown: Sequence[int]) -> CurveTable:
    """The curves of these numbers."""
    factor, unit = amplitude_scale(source.curves)
    sampled = any(is_sampled(curve) for curve in source.curves)
    peak, worst = "peak of main branch", "worst motion"
    headings = ["curve", *(quantity(key).axis() for key in source.swept), f"{worst} [Hz]", f"{worst} [{unit}]"]
    headings += ["on branch", f"{peak} [Hz]", f"{peak} [{unit}]", "harmonics", "truncation error"]
    headings += [*("sampling error",) * sampled, "energy error", "points", "seconds"]
    rows = []
    for number in shown:
        curve = source.curves[number]
        first = [str(number), *(bare_value(key, value) for key, value in curve.member.parameters.items())]
        failed = [Cell("-")] * (len(headings) - len(first))
        cells = failed if curve.facts is None else _curve_cells(curve, curve.facts, factor, sampled)
        notes = (f"failed: {curve.reason}",) if curve.facts is None else tuple(_notes(curve))
        rows.append((number, (*map(Cell, first), *cells), notes))
    return CurveTable(tuple(headings), sampled, tuple(rows))


def _curve_cells(curve: CurveResult, facts: CurveSummary, factor: float, sampled: bool) -> list[Cell]:
    frequency, amplitude, branch = worst_cells(facts, factor)
    sampling = max(facts.sampling_error, facts.sampling_frequency_error)
    truncation = truncation_cell(facts.truncation_error, facts.truncation_branch)
    sampling_cell = Cell(share(sampling) if is_sampled(curve) else "none", _plain(sampling), "sampling")
    return [
        Cell(frequency, _plain(facts.worst_frequency_hz), "worst_frequency"),
        Cell(amplitude, _plain(facts.worst_amplitude_m), "worst_amplitude"),
        Cell(branch),
        _number(facts.peak_frequency_hz, f"{{:.6g}}{END_MARK * facts.peak_at_end}", name="frequency"),
        _number(facts.peak_amplitude_m, "{:.4g}", factor, "amplitude"),
        Cell(str(facts.harmonics), str(facts.harmonics), "harmonics"),
        Cell(truncation, _plain(facts.truncation_error), "truncation"),
        *(sampling_cell,) * sampled,
        _number(facts.energy_error, "{:.0e}", name="energy"),
        Cell(str(facts.points), str(facts.points), "points"),
        _number(facts.seconds, "{:.2f}", name="seconds"),
    ]


def _notes(curve: Any) -> Iterable[str]:
    facts = curve.facts
    if not curve.complete:
        yield f"incomplete: {curve.reason}"
    if said := end_said(facts):
        yield said
    if has_static_load(curve) and (said := static_said(curve)):
        yield said
    if peak_is_unstable(facts):
        yield "unstable peak"
    yield from seen_remarks(facts)
    for said in open_remarks(facts):
        yield f">=: {said}" if facts.worst_unresolved and said.endswith(facts.worst_unresolved) else said
    if facts.truncation_branch == "detached":
        where = f"{facts.truncation_frequency_hz:.6g} Hz"
        yield f"with more harmonics the peak lies on a detached branch, that of the main branch at {where}"
    if facts.truncation_branch == "lost":
        yield "the peak could not be followed to more harmonics on its branch"
    for count, branch in enumerate(facts.detached, start=1):
        yield f"detached branch {count}, {branch_said(branch)}{branch_remarks(branch)}"
    kinds = [item["kind"] for item in facts.bifurcations]
    for kind in dict.fromkeys(kinds):
        yield f"{kind}: {kinds.count(kind)}"


def frequency_tables(source: ReportSource) -> list[FrequencyTable]:
    """One table for every entry of `models` in summary.json."""
    tables = []
    for number, row in enumerate(source.model_rows, start=1):
        of_order = row.get("free_at_order_hz", {})  # with a disk
        states = {} if of_order else {"free": row["free_hz"]}
        for order in row["stuck_hz"]:
            if order in of_order:
                names = ", ".join(row.get("free_names", {}).get(order, ())[:SHOWN_FREQUENCIES])
                states[f"free, engine order {order}{': ' * bool(names)}{names}"] = of_order[order]
            states[f"sliding, engine order {order}"] = row["sliding_hz"][order]
            states[f"stuck, engine order {order}"] = row["stuck_hz"][order]
        rows = tuple(
            (state, tuple(_number(value, "{:.6g}") for value in values[:SHOWN_FREQUENCIES]))
            for state, values in states.items()
        )
        kn, kt = (value_label(f"contact.{k}_stiffness", row[f"{k}_stiffness"]) for k in ("normal", "tangential"))
        of = [f"Model {number}", *_own_values(source, row["rom"])] if len(source.model_rows) > 1 else []
        heading = ", ".join([*of, f"whole face {kn}", kt])
        tables.append(FrequencyTable(heading, max(len(values) for _, values in rows), rows))
    return tables


def _own_values(source: ReportSource, rom: str) -> list[str]:
    """The swept values that distinguish the curves of one reduced model from the others."""
    swept = [curve.member.parameters for curve in source.curves]
    on_it = [c.member.parameters for c in source.curves if c.rom and relative_path(c.rom, source.out) == rom]
    labels = []
    for key in source.swept:
        values = {repr(values[key]): values[key] for values in on_it}
        if len(values) == 1 and len({repr(values[key]) for values in swept}) > 1:
            labels.append(value_label(key, next(iter(values.values()))))
    return labels


def blade_rows(scene: Scene) -> list[tuple[str, str]]:
    """The blade, what touches its neighbours, and its material."""
    if scene.mesh_file is not None:
        return _rows_of_file(scene)
    blade, material = airfoil_of(scene), scene.material
    assert material is not None
    shape = blade.section if blade.sections is None else f"sections of {Path(blade.sections.name).name}"
    return [
        ("blades of the ring", str(blade.n_blades)),
        ("length, hub radius", f"{_mm(blade.length)}, {_mm(blade.hub_radius)}"),
        ("airfoil", f"{shape}, chord {_mm(blade.chord)}, thickness {_mm(blade.thickness)}"),
        ("thickness at the shroud, twist", f"{_mm(blade.tip_thickness or blade.thickness)}, {blade.twist:g}°"),
        ("stagger at root, at shroud", f"{blade.root_stagger:.4g}°, {blade.tip_stagger:.4g}°"),
        *([("camber", f"{blade.camber:g}°")] if blade.sections is None else []),
        *_contact_part_rows(scene),
        ("material", _material_said(material.properties)),
        *_disk_rows(scene),
        ("speed", f"{scene.load.speed_rpm:g} rev/min"),
    ]


def _material_said(properties: Mapping[str, Any]) -> str:
    """Young's modulus with its values over the temperature, shear modulus of a crystal, density."""
    words = [f"E = {properties['young_modulus'] / 1e9:g} GPa"]
    others = [row for row in properties.get("at", ()) if "young_modulus" in row]
    if others:
        words[0] += f" at {properties.get('temperature', 20.0):g}"
        words += [f"{row['young_modulus'] / 1e9:g} at {row['temperature']:g}" for row in others]
    if "shear_modulus" in properties:
        words.append(f"anisotropic, G = {properties['shear_modulus'] / 1e9:g} GPa")
    return ", ".join((*words, f"{properties['density']:g} kg/m³"))


def _contact_part_rows(scene: Scene) -> Iterator[tuple[str, str]]:
    """Shroud, snubber and platform, those that there are."""
    from geometry.blade.fitting import side_edge_angle

    parameters = geometry_parameters(scene)
    blade, shroud = parameters["blade"], parameters["shroud"]
    if shroud is not None:
        yield "shroud angle, side edges", f"{shroud.angle:g}°, {side_edge_angle(blade, shroud):g}°"
        wide = f"{_mm(shroud.thickness)} thick, {_mm(shroud.axial_width)} wide, gap {_mm(shroud.gap)}"
        yield "shroud", wide
    tip = 0.0 if shroud is None else shroud.fillet_radius
    yield "fillets at root, at shroud", f"{_mm(blade.fillet_radius)}, {_mm(tip)}"
    if (snubber := scene.snubber) is not None:
        wide = f"{_mm(snubber.thickness)} thick, {_mm(snubber.width)} wide, gap {_mm(snubber.gap)}"
        yield "snubber", f"at {_mm(snubber.radius)}, {wide}, {snubber.angle:g}°"
    if (platform := scene.platform) is not None:
        yield "platform", f"at {_mm(platform.radius)}, {_mm(platform.thickness)} thick, {platform.flank_angle:g}°"


def _disk_rows(scene: Scene) -> list[tuple[str, str]]:
    """The disk, where there is one."""
    disk, material = scene.disk, scene.material
    if disk is None or material is None or scene.blade is None:
        return []
    of_disk = scene.materials.get("disk", material)
    inner = (disk.bore_radius, disk.bore_width or disk.rim_width)
    sections = [inner, *disk.profile, (scene.blade.hub_radius, disk.rim_width)]
    widths = "; ".join(f"{_mm(width)} at {_mm(radius)}" for radius, width in sections)
    return [
        ("disk: widths, bore", f"{widths}; {disk.bore}"),
        ("disk: material", _material_said(of_disk.properties)),
    ]


def mesh_rows(model: BuiltModel, scene: Scene) -> list[tuple[str, str]]:
    """Size and quality of the mesh, and the size of the reduced model."""
    from geometry.quality import scaled_jacobian
    from rom.files.sector_file import load_sector

    assert model.mesh is not None
    folder = model.mesh.parent
    sector = load_sector(folder / SECTOR)
    quality = np.concatenate([scaled_jacobian(sector.points, block) for block in sector.blocks])
    facts, found = model.facts, own_findings(folder)
    materials = materials_of_file(scene, found) if found else {}
    return [
        ("elements", _elements(sector, scene)),
        ("degrees of freedom", str(facts["dofs"])),
        ("nodes of the mesh" if scene.mesh_file else "vertices", str(len(sector.points))),
        ("scaled Jacobian, smallest, mean (1: a brick)", f"{quality.min():.2f}, {quality.mean():.2f}"),
        *(("materials", line) for material in materials.values() for line in (material.line, *material.notes)),
        *(("found in the file", line) for line in found.get("findings", ())),
        ("reduced degrees of freedom", str(facts["reduced_dofs"])),
        ("fixed-interface modes", str(facts["modes"])),
        *([("motions of a cut face", str(facts["cut_face_motions"]))] if "cut_face_motions" in facts else []),
    ]


def _rows_of_file(scene: Scene) -> list[tuple[str, str]]:
    """A blade whose mesh comes from a file."""
    mesh = scene.mesh
    assert mesh is not None
    axis = mesh.axis if isinstance(mesh.axis, str) else ", ".join(f"{value:g}" for value in mesh.axis)
    return [
        ("blades of the ring", str(mesh.n_blades)),
        ("mesh file", Path(mesh.file or "").name),
        ("unit, engine axis in the file", f"{mesh.unit}, {axis}"),
        *([("bore of the disk", "free")] if mesh.bore == "free" else []),
        ("speed", f"{scene.load.speed_rpm:g} rev/min"),
    ]


def _elements(sector: SectorMesh, scene: Scene) -> str:
    """Number, kind and size of the elements."""
    assert scene.mesh is not None
    if scene.mesh.size is not None:
        return f"{sector.n_elements} {scene.mesh.element}, size {_mm(scene.mesh.size)}"
    kinds = ", ".join(f"{count} {kind}" for kind, count in elements_by_kind(sector).items())
    return f"{kinds}, mean edge {1e3 * mean_size(sector):.3g} mm"


def over_sweep(source: ReportSource, rows: Callable[[Scene], list[tuple[str, str]]]) -> list[tuple[str, str]]:
    """Rows of the whole sweep: where the curves differ, the first and the last text in the order of the values."""
    keys = sweep_keys([curve.member for curve in source.curves])
    members = sorted(
        (curve.member for curve in source.curves),
        key=lambda member: [key.number(member.parameters[key.name]) for key in keys],
    )
    tables = [rows(member.scene) for member in members]
    found = []
    for place, (name, _) in enumerate(tables[0]):
        texts = list(dict.fromkeys(table[place][1] for table in tables))
        many = f" ({len(texts)} values)" if len(texts) > 2 else ""
        found.append((name, texts[0] if len(texts) == 1 else f"{texts[0]} ... {texts[-1]}{many}"))
    return found


def contact_rows(face: ContactFace, scene: Scene, interfaces: Mapping[str, int]) -> list[tuple[str, str]]:
    """The contact face, its law and the excitation."""
    assert scene.mesh is not None
    contact, along = scene.contact, scene.mesh.contact_grid
    cycle = "event-driven" if contact.integration == "exact" else f"{contact.samples} samples"
    direction = ", ".join(f"{value:.3f}" for value in np.round(face.frame[0, 2], 3) + 0.0)
    return [
        ("contact nodes", f"{along[0]} along the segment × {along[1]} along the radius on each face"),
        ("area of a face", f"{face.area.sum() * 1e6:.3g} mm²"),
        ("normal (x axial, y circumferential, z radial)", direction),
        *_interface_rows(scene, interfaces),
        ("contact integration", cycle),
        *load_rows(scene),
        ("structural damping", _damping(scene)),
    ]


def cost_rows(source: ReportSource) -> list[tuple[str, int, float]]:
    """What each stage's results took to make, s, whether in this run or before, and how many they are."""
    return [(stage.results, source.results[stage], source.costs[stage]) for stage in Stage if stage in source.costs]


def _damping(scene: Scene) -> str:
    response = scene.response
    if response.rayleigh is not None:
        return f"C = {response.rayleigh[0]:g} M + {response.rayleigh[1]:g} K"
    return f"damping ratio {quantity('response.damping_ratio').value(response.damping_ratio)}"


def _number(value: float, form: str, factor: float = 1.0, name: str = "") -> Cell:
    return Cell(form.format(value * factor) if math.isfinite(value) else "-", _plain(value), name)


def _plain(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else ""


def _mm(metres: float) -> str:
    return f"{metres * 1e3:g} mm"

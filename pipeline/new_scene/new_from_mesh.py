"""`shroud new DIR --mesh FILE`: a look at a mesh file, a scene to start from, and a picture with coloured faces.

The picture shows contact faces and root from two sides; it needs no GL library.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import input_error, reason_of
from pipeline.figures.style import drawn, styled
from pipeline.new_scene.mesh_survey import Guess, guess, set_nodes, survey
from pipeline.new_scene.templates import PRESET, SCENE, SCHEMA, new_files
from pipeline.render.ring import LEFT_DARK, RIGHT_COLOUR
from pipeline.report.viewer import triangles_of
from pipeline.results.frequency_range import resonances_of
from pipeline.results.resonances import modes_about
from pipeline.scene.presets import PRESETS
from pipeline.scene.reading import Member, given_scene, parameter_error
from pipeline.stages.model.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.model.build_mesh import SECTOR, findings_of, read_mesh_file, sector_choice, write_findings
from pipeline.stages.model.build_reduced_model import make_reduced_model
from pipeline.stages.model.check_meshes import check_reduction
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.model.scene_materials import FileMaterial, check_materials, materials_of_file

if TYPE_CHECKING:
    from geometry.elements import ElementBlock
    from geometry.imported_mesh import ImportedMesh
    from geometry.own_mesh.own_sector import OwnSector
    from geometry.own_mesh.sector_choice import InterfaceChoice
    from geometry.sector import SectorMesh
    from pipeline.new_scene.mesh_survey import Guess
    from pipeline.scene.schema import Scene


STEEL = {"young_modulus": 210e9, "poisson_ratio": 0.3, "density": 7850.0}
UNITS = {"young_modulus": "Pa", "density": "kg/m^3"}
# contact dofs and contact nodes of a face along it and along the radius, in the order in which they are tried
GRIDS: tuple[tuple[str, tuple[int, int]], ...] = (
    *(("mortar", grid) for grid in ((3, 3), (3, 2), (2, 3), (2, 2))),
    *(("patch", grid) for grid in ((3, 3), (3, 2), (2, 3), (2, 2))),
    *(("mortar", grid) for grid in ((2, 1), (1, 2), (1, 1))),
)
SOFT = 1e-4  # contact stiffness to start with, over E sqrt(A)
SEATED = 0.3  # the same where bodies are held by their contacts
COLUMN = 30


@dataclass(frozen=True)
class StartingValues:
    """Numbers of a scene that are told from the mesh."""

    material: Mapping[str, float] | None = None  # A material of the file in SI units, where it has all numbers
    area: float | None = None  # area of a contact face, m^2
    frequency: tuple[float, float] | None = None  # range around the first excited mode, Hz
    general: bool = True  # whether elements need [material]
    # by material of the file: numbers that the user has to give
    incomplete: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    modulus: float | None = None  # young's modulus of a material of the file, Pa
    grid: tuple[int, int] = (3, 3)  # contact nodes on a face
    contact_dofs: str = "mortar"
    touches: bool = True  # whether the sector has contact faces
    heat: tuple[float, float, float] | None = None  # temperatures of the file from, to, and one free of stress


def scene_of_mesh(name: str, title: str, file: str, guess: Guess, values: StartingValues) -> str:
    """The scene as TOML."""
    blades = guess.n_blades
    order = 1 if blades is None else blades // 2
    material = {key: (values.material or STEEL)[key] for key in STEEL}
    modulus = material["young_modulus"] if values.modulus is None else values.modulus
    area = 6e-5 if values.area is None else values.area
    normal = float(f"{(SEATED if guess.interfaces else SOFT) * modulus * area**0.5:.2g}")
    low, high = values.frequency or (100.0, 2000.0)
    lines = [
        f"#:schema ./{SCHEMA}",
        "#",
        f"# A scene for the mesh of a sector from another program; run it with `shroud run {SCENE}`.",
        "#",
        *_keys(
            {"name": name, "title": title, "accuracy": PRESET}, {"accuracy": " or ".join(map(json.dumps, PRESETS))}
        ),
        *_mesh_lines(file, guess, values.grid),
        "",
        *_material_lines(material, values),
        *_named_materials(guess, values),
        *(["[rom]", f'contact_dofs = "{values.contact_dofs}"', ""] if values.contact_dofs != "mortar" else []),
        "[load]",
        *_keys({"speed_rpm": 3000.0 if guess.interfaces else 0.0}, {"speed_rpm": "rotation; 0 = none"}),
        "",
        *_heat_lines(values),
        *_contact_lines(guess, normal, values.touches),
        "[excitation]",
        *_keys(
            {"engine_order": order, "force": 1.0, "direction": "y"}, {"force": "N", "direction": "circumferential"}
        ),
        "",
        "[response]",
        *_keys({"frequency": [low, high]}, {"frequency": _frequency_comment(values)}),
        *_keys({"damping_ratio": 0.003}, {"damping_ratio": "of every mode, besides the friction"}),
        "",
        "[render]                      # without this section nothing is rendered",
        "modes = [1, 2, 3]",
    ]
    return "\n".join(lines) + "\n"


def _mesh_lines(file: str, guess: Guess, grid: tuple[int, int]) -> list[str]:
    """[mesh], [mesh.sets] and [mesh.interface.NAME]."""
    blades = guess.n_blades
    roles = ("root", *(() if guess.interfaces else ("contact_right", "contact_left")), "tip")
    return [
        "",
        "[mesh]",
        *_keys({"file": file}, {"file": "relative to this file"}),
        *_keys({"unit": guess.unit}, {"unit": "of the file and its materials"}),
        *(
            []
            if blades is not None
            else ["# n_blades = ...              # of the ring: to be set, the file does not say"]
        ),
        *(_keys({"n_blades": blades}, {"n_blades": "of the ring"}) if blades is not None else []),
        *_keys({"axis": guess.axis}, {"axis": "engine axis in the file"}),
        *(
            _keys({"axis_point": [*guess.axis_point]}, {"axis_point": "a point of it"})
            if any(guess.axis_point)
            else []
        ),
        *_keys({"contact_grid": [*grid]}, {"contact_grid": "contact nodes on a face, along it and along the radius"}),
        *(
            ['# bore = "free"               # nothing holds the disk: without a root']
            if "cyclic_right" in guess.sets
            else []
        ),
        "",
        "[mesh.sets]                   # node sets or surfaces of the file; what is left out is found by geometry",
        *(f"{role} = {json.dumps(chosen, ensure_ascii=False)}" for role, chosen in guess.sets.items()),
        *(f'# {role} = "..."' for role in roles if role not in guess.sets),
        *(line for name, each in guess.interfaces.items() for line in _interface_lines(name, each)),
    ]


def _interface_lines(name: str, interface: InterfaceChoice) -> list[str]:
    """[mesh.interface.NAME]."""
    values = {"kind": interface.kind, "right": interface.right, "left": interface.left}
    return ["", f"[mesh.interface.{name}]", *_keys(values, {"kind": "inside the sector, or between neighbours"})]


def _named_materials(guess: Guess, values: StartingValues) -> list[str]:
    """[materials.NAME]: numbers that are in other units in the file, and those that it lacks, to be set."""
    lines = []
    for name in dict.fromkeys([*guess.numbers, *values.incomplete]):
        given, missing = guess.numbers.get(name, {}), values.incomplete.get(name, ())
        table = f"[materials.{name if name.replace('-', '').replace('_', '').isalnum() else json.dumps(name)}]"
        lines += [f"{table.ljust(COLUMN - 1)} # takes precedence over what the file says of it", *_keys(given, UNITS)]
        lines += [
            f"# {key} = ...".ljust(COLUMN - 1) + f" # {UNITS.get(key, '')}: to be set".replace(" : ", " ")
            for key in missing
            if key not in given
        ]
        lines.append("")
    return lines


def _keys(values: Mapping[str, object], comments: Mapping[str, str]) -> list[str]:
    """A line for each key, with its comment; an empty text is left out."""
    lines = []
    for key, value in values.items():
        if value == "":
            continue
        text = f"{key} = {_toml(value)}"
        lines.append(f"{text.ljust(COLUMN - 1)} # {comments[key]}" if key in comments else text)
    return lines


def _toml(value: object) -> str:
    if isinstance(value, float):
        return f"{value:g}" if "e" in f"{value:g}" or "." in f"{value:g}" else f"{value:.1f}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def _material_lines(material: Mapping[str, float], values: StartingValues) -> list[str]:
    """[material], where a number of it may be needed."""
    if not (values.material or values.general):
        return []
    comment = "# for elements without one; as in the file" if values.material else "# steel: set yours"
    return ["[material]" + " " * 20 + comment, *_keys(material, UNITS), ""]


def _heat_lines(values: StartingValues) -> list[str]:
    """[load.temperature], where the file has temperatures and materials that they matter to."""
    if values.heat is None:
        return []
    low, high, reference = values.heat
    said = {"of_mesh": f"those of the file, {low:g} to {high:g}", "reference": "without thermal stress: to be set"}
    return ["[load.temperature]", *_keys({"of_mesh": True, "reference": reference}, said), ""]


def _heat_of(own: OwnSector, materials: Mapping[str, FileMaterial]) -> tuple[float, float, float] | None:
    """Temperatures of a file that gives them to all nodes, from, to, and that nearest to 20 in all tables."""
    field = own.sector.temperature
    tables = [each.properties for each in materials.values() if each.properties.get("at")]
    grids = [[row["temperature"] for row in (table, *table["at"])] for table in tables]
    grows = any(each.numbers.get("expansion") for each in materials.values())
    if field is None or np.isnan(field).any() or not (tables or grows):
        return None
    low, high = max(map(min, grids), default=20.0), min(map(max, grids), default=20.0)
    return float(field.min()), float(field.max()), max(low, min(high, 20.0))


def _contact_lines(guess: Guess, normal: float, touches: bool) -> list[str]:
    """[contact], which a sector without contact faces does without."""
    if not touches:
        return ["# no [contact]: no contact faces are named or found", ""]
    given = {"normal_stiffness": normal, "tangential_stiffness": float(f"{0.75 * normal:.2g}"), "friction": 0.4}
    said = {"normal_stiffness": 'N/m for the whole face, to be set; or "punch"', "friction": "friction coefficient"}
    interference = 0.0 if guess.interfaces else 5e-6
    return [
        "[contact]",
        *_keys(given, said),
        *_keys({"interference": interference}, {"interference": "m; below 0: gap"}),
        "",
    ]


def _frequency_comment(values: StartingValues) -> str:
    return "Hz, around the first mode that this engine order excites" if values.frequency else "Hz, to be set"


Array = NDArray[np.float64]
ROOT_COLOUR, BODY = "#009E73", (0.78, 0.82, 0.86)
COLOURS = {"contact_right": RIGHT_COLOUR, "contact_left": LEFT_DARK, "root": ROOT_COLOUR}
NAMES = {"contact_right": "right contact face (+y)", "contact_left": "left contact face (-y)", "root": "clamped root"}
INSIDE = {"contact_right": "right faces", "contact_left": "left faces"}  # where interfaces are named
APART = 0.12  # of the size of the mesh, by which bodies are drawn apart: their faces lie on each other
MOST_EDGES = 20_000  # triangles above which edges of elements are not drawn


def mesh_picture(
    points: Array,
    blocks: tuple[ElementBlock, ...],
    marked: Mapping[str, NDArray[np.int64]],
    title: str,
    interfaces: Collection[str] = (),
) -> bytes:
    """PNG of the boundary of a mesh from both sides; `interfaces`: names of those whose faces are marked, if any.

    Shapes: `points` (N, 3), `marked` (k,).
    """
    from matplotlib.figure import Figure

    triangles = triangles_of(blocks)
    said = {role: f"{text}: {', '.join(interfaces)}" for role, text in INSIDE.items()}
    names = NAMES | (said if interfaces else {})
    rows: dict[str, NDArray[np.bool_]] = {}
    colours = np.tile(np.array(BODY), (len(triangles), 1))
    for role, nodes in marked.items():
        rows[role] = np.asarray(np.isin(triangles, nodes).all(axis=1))
        colours[rows[role]] = _rgb(COLOURS[role])
    with styled():
        figure: Any = Figure(figsize=(9.0, 5.6), layout="constrained")
        views = (("contact_right", 1.0, "from above"), ("contact_left", -1.0, "from below"))
        for axes, (role, side, where) in zip(figure.subplots(1, 2), views, strict=True):
            view = _towards(points, triangles[rows[role]]) if role in rows else np.array([-0.6, 0.8, 0.0]) * side
            view = view + np.array([0.45 * view[1], -0.45 * view[0], 0.45 * side])  # a little from the side
            _draw(axes, points, triangles, colours, view / np.linalg.norm(view))
            axes.set_title(f"{names[role]}, {where}" if role in rows else where)
        _legend(figure, marked, names)
        figure.suptitle(title)
        return drawn(figure, "png")


def _towards(points: Array, triangles: NDArray[np.int64]) -> Array:
    """The horizontal direction (3,) that some triangles face on average."""
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0) * [1.0, 1.0, 0.0]
    return np.asarray(normal / max(float(np.linalg.norm(normal)), 1e-300))


def _draw(axes: Any, points: Array, triangles: NDArray[np.int64], colours: Array, view: Array) -> None:
    """The triangles that face the viewer, from back to front, shaded."""
    from matplotlib.collections import PolyCollection

    right = np.cross((0.0, 0.0, 1.0), view)
    right /= np.linalg.norm(right)
    screen = np.stack([right, np.cross(view, right)])
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = normal @ view / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    seen = np.flatnonzero(facing > 0.0)
    seen = seen[np.argsort((corners[seen] @ view).mean(axis=1), kind="stable")]
    shade = colours[seen] * (0.55 + 0.45 * facing[seen, None])
    edge = shade if len(triangles) > MOST_EDGES else 0.75 * shade
    axes.add_collection(
        PolyCollection(list(corners[seen] @ screen.T), facecolors=shade, edgecolors=edge, linewidths=0.25)
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()


def _legend(figure: Any, marked: Mapping[str, Any], names: Mapping[str, str]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(color=COLOURS[role], label=names[role]) for role in COLOURS if role in marked]
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _rgb(colour: str) -> Array:
    from matplotlib.colors import to_rgb

    return np.array(to_rgb(colour))


PICTURE = "mesh.png"
MOST_POINTS = 12_000  # nodes of a mesh of which the first excited mode is computed
MODES = 10
BELOW, ABOVE = 0.6, 1.4  # of the frequency range, over the lowest free and stuck frequency


@dataclass(frozen=True)
class MeshOptions:
    """What the command line says about a mesh file; None: to be told from the file."""

    # `unit`, `axis`: as in [mesh]
    unit: str | None = None
    axis: str | None = None
    n_blades: int | None = None  # number of blades


@dataclass(frozen=True)
class NewScene:
    """What was written, and what was found."""

    files: tuple[Path, ...]  # scene, schema and picture
    found: tuple[str, ...]  # what is in the file, a line each
    problem: str  # why the file does not make a sector yet, with what to change; empty where it does


def new_scene_of_mesh(folder: Path, title: str, file: Path, options: MeshOptions) -> NewScene:
    """Look at a mesh file, write a scene for it and a picture into a folder."""
    if not file.is_file():
        raise input_error(file, "", "no such file")
    mesh = read_mesh_file(str(file))
    told = guess(mesh, options.unit, options.axis, options.n_blades)
    name = os.path.relpath(file.resolve(), folder.resolve()).replace(os.sep, "/")
    heading = folder.resolve().name
    text = partial(scene_of_mesh, heading, title, name, told)
    own, problem, values, materials = _tried(folder, text, mesh, told)
    interfaces = () if own is None or not told.interfaces else tuple(own.sector.interfaces)
    picture = mesh_picture(*_drawn(mesh, told, own), f"{file.name}: {_heading(own, told)}", interfaces)
    files = new_files(folder, text(values), {PICTURE: picture})
    lines = [*survey(mesh), *told.why]
    lines += [] if own is None else [line for line in own.findings.lines if not {line, f"note: {line}"} & {*lines}]
    lines += [line for line in materials if f"note: {line}" not in lines]
    return NewScene(tuple(files), tuple(lines), problem)


def _tried(
    folder: Path, text: Callable[[StartingValues], str], mesh: ImportedMesh, told: Guess
) -> tuple[OwnSector | None, str, StartingValues, list[str]]:
    """The sector that the guess makes of the mesh, what is wrong, numbers to start with, its materials in words."""
    from geometry.errors import ParameterError

    if told.n_blades is None:
        return (
            None,
            f"{folder / SCENE}: mesh.n_blades: missing, allowed: a whole number, 3 to 10000",
            StartingValues(),
            [],
        )
    import tomllib

    def scene_of(values: StartingValues) -> Scene:
        return given_scene(tomllib.loads(text(values)), {}).first

    try:
        own, start = _reducible(mesh, scene_of)
    except ParameterError as error:
        return None, f"{folder / SCENE}: {reason_of(error)}", StartingValues(), []
    found = findings_of(own)
    materials = materials_of_file(scene_of(start), found)
    stiffest = sorted(materials.values(), key=lambda m: -m.numbers.get("young_modulus", 0.0))
    complete = [m.numbers for m in stiffest if m.name and not m.missing and not m.unread and m.of_file]
    incomplete = {m.name: m.missing for m in materials.values() if m.name and m.missing and (m.unread or m.numbers)}
    modulus = next((m.numbers["young_modulus"] for m in stiffest if "young_modulus" in m.of_file), None)
    area = sum(float(view.right.area.sum()) for view in own.sector.views.values())
    general = any(not m.name or not (m.numbers or m.unread) for m in materials.values())
    material = complete[0] if complete else None
    values = StartingValues(material, area, None, general, incomplete, modulus, start.grid, start.contact_dofs)
    values = replace(values, touches=found["touches"], heat=_heat_of(own, materials))
    scene = scene_of(values)
    lines = [m.line for m in materials.values() if m.numbers]
    try:
        lines += [line for line in check_materials(scene, found, force=False) if line not in mesh.notes]
        check_reduction(scene, own.sector, found)
    except ParameterError as error:
        return own, str(parameter_error(folder / SCENE, Member(0, scene, {}), error)), values, lines
    return own, "", replace(values, frequency=_frequency_range(scene, own)), lines


def _reducible(mesh: ImportedMesh, scene_of: Callable[[StartingValues], Scene]) -> tuple[OwnSector, StartingValues]:
    """The sector with the finest contact grid that its faces can tell apart, or the first one where none is.

    ParameterError where the mesh makes no sector.
    """
    from geometry.errors import ParameterError
    from geometry.own_mesh.own_sector import sector_from_mesh
    from rom.reduction.boundary_dofs import BoundaryChoice, check_reducible

    first: OwnSector | None = None
    for contact_dofs, grid in GRIDS:
        values = StartingValues(grid=grid, contact_dofs=contact_dofs)
        scene = scene_of(values)
        assert scene.mesh is not None
        try:
            own = sector_from_mesh(mesh, sector_choice(scene.mesh))
            first = first or own
            check_reducible(own.sector, BoundaryChoice(contact_dofs=contact_dofs))
        except ParameterError as error:
            if first is None:
                raise
            if error.parameter != "contact_dofs":
                break
        else:
            return own, values
    assert first is not None
    return first, StartingValues()


def _frequency_range(scene: Scene, own: OwnSector) -> tuple[float, float] | None:
    """A range around the first mode that the engine order excites, free and stuck; None for a large mesh."""
    if len(own.sector.points) > MOST_POINTS:
        return None
    from rom.files.sector_file import save_sector

    rom = scene.rom.model_copy(update={"modes": MODES, "frequency_limit": None})
    scene = scene.model_copy(update={"rom": rom})
    with tempfile.TemporaryDirectory() as name, suppress(Exception):  # the range is only to start with
        place = Path(name)
        save_sector(place / SECTOR, own.sector)
        write_findings(place, own)
        full = make_full_model(place, place / SECTOR, scene)
        make_reduced_model(place, place / SECTOR, place / FULL_MODEL, scene, store_basis=False, assembled=[full])
        first = modes_about(resonances_of(place / REDUCED_MODEL, scene), (0.0, 0.0))[0]
        ends = [end.frequency_hz for end in first.values()]  # what floats has no free one
        return float(f"{BELOW * min(ends):.2g}"), float(f"{ABOVE * max(ends):.2g}")
    return None


def _drawn(mesh: ImportedMesh, told: Guess, own: OwnSector | None) -> tuple[Any, Any, dict[str, Any]]:
    """Points, elements and marked nodes of the picture: of the sector, or of the file as it is."""
    if own is not None:
        views = own.sector.views.values()
        faces = {f"contact_{side}": [view.node_sets[f"face_{side}"] for view in views] for side in ("right", "left")}
        marked = {role: np.unique(np.concatenate(nodes)) for role, nodes in faces.items()}
        return _bodies_apart(own.sector), own.sector.blocks, {**marked, "root": own.sector.node_sets["root"]}
    roles = ("contact_right", "contact_left", "root")
    return mesh.points, mesh.blocks, {role: set_nodes(mesh, told.sets[role]) for role in roles if role in told.sets}


def _bodies_apart(sector: SectorMesh) -> Array:
    """Points (N, 3) of a mesh with its bodies moved outward from each other, the innermost one in place."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    first = np.concatenate([np.repeat(block.nodes[:, 0], block.nodes.shape[1]) for block in sector.blocks])
    nodes = np.concatenate([block.nodes.ravel() for block in sector.blocks])
    size = len(sector.points)
    graph = coo_matrix((np.ones(len(nodes), dtype=np.int8), (first, nodes)), shape=(size, size))
    body = connected_components(graph, directed=False)[1]
    inner = np.array([sector.points[body == k, 2].min() for k in range(body.max() + 1)])
    step = APART * float(np.ptp(sector.points[:, 2]))
    return sector.points + np.outer(step * np.argsort(np.argsort(inner))[body], [0.0, 0.0, 1.0])


def _heading(own: OwnSector | None, told: Guess) -> str:
    if own is None:
        return "as in the file"
    return f"{told.n_blades} blades, unit {told.unit}, axis {told.axis}; x engine axis, z radial"

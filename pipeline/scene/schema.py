"""The scene: all keys of a scene file, as frozen pydantic models. SI units, angles in degrees.

Every field says what it means with its unit (`description`) and what is allowed (`allowed`); error messages
quote the latter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, PrivateAttr, field_validator, model_validator

from pipeline.scene.aero_section import Aero, AeroFamily
from pipeline.scene.contact_section import NO_TABLE, Contact, Interface, contact_unless_of_a_file
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, interface_of
from pipeline.scene.fields import (
    BLADES,
    FILLET,
    LENGTH,
    POSITIVE,
    Length,
    NotNegative,
    Number,
    Positive,
    Ratio,
    Section,
    StudyKeys,
    Truth,
    Vector,
    Whole,
    key,
)
from pipeline.scene.fields import key as _key
from pipeline.scene.loads_section import (
    ExcitationHarmonic,
    ExcitationLoad,
    Output,
    Pressure,
    StaticForce,
    Temperature,
    placed,
    unit_vector,
)
from pipeline.scene.material_section import Fatigue, Material, NamedMaterial, Stress
from pipeline.scene.mesh_section import MAIN_INTERFACE, Mesh
from pipeline.scene.model_section import Model
from pipeline.studies.backbone.section import Backbone
from pipeline.studies.flutter.section import Flutter
from pipeline.studies.map.section import Map
from pipeline.studies.mistuning.section import Mistuning
from pipeline.studies.optimum.section import Optimum
from pipeline.studies.uncertainty.section import Uncertainty
from pipeline.studies.wear.section import Wear


class Disk(Section):
    """[disk]: the disk that carries the blades; without it each blade is clamped at its root."""

    bore_radius: Length = key("inner radius, m", LENGTH)
    rim_width: Length = key("axial width at the hub radius, m; the airfoil stands on it", LENGTH)
    bore_width: Length | None = key(
        "axial width at the bore, m; by default that of the rim, linear between them", LENGTH, None
    )
    profile: tuple[tuple[Length, Length], ...] = key(
        "[radius, axial width], m, at further radii between bore and rim",
        "a list of [radius, width], two numbers above 0, {bounds}, with ascending radii",
        (),
    )
    bore: Literal["clamped", "free"] = key("whether the bore is held", "{words}", "clamped")
    size: Length | None = key(
        "length of the elements along the radius at the bore, m; by default three times mesh.size", LENGTH, None
    )


class Render(Section):
    """[render]: pictures of mode shapes. Without this section they are drawn where asked for by name."""

    modes: Annotated[tuple[Annotated[Whole, Field(ge=1, le=100)], ...], Field(min_length=1, max_length=20)] = _key(
        "mode shapes to draw, 1 is the lowest", "a list of {count} whole numbers, {bounds}", (1, 2, 3)
    )
    deformation: Number = _key(
        "largest drawn displacement as a fraction of the blade's length",
        "a number above 0, {bounds}",
        0.08,
        ge=1e-12,
        le=1.0,
    )
    contact: Literal["free", "sliding", "stuck"] = _key("how the shrouds are joined", "{words}", "free")
    operating: Truth | Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=20)] = (
        _key(
            "motion at the peak: true for the curves with the highest and the lowest peak, or their numbers from 0",
            "true, false or a list of {count} numbers of curves, the first is 0",
            False,
        )
    )
    blades: Whole = _key("neighbours drawn side by side", "a whole number, {bounds}", 3, ge=1, le=9)


class Figures(Section):
    """[figures]: files that the figures are written to."""

    formats: Annotated[tuple[Literal["png", "svg"], ...], Field(min_length=1)] = _key(
        "formats of every figure", 'a list of "png", "svg" or both', ("png",)
    )
    bifurcations: Truth = _key("whether the response figure marks bifurcations but folds", "true or false", False)


DEFAULT_MODES = 30
DAMPER = "damper"
INTERFACES = {  # contact interfaces that the sections of a blade made here make
    "shroud": (MAIN_INTERFACE,),
    "snubber": ("snubber",),
    DAMPER: ("damper_right", "damper_left"),
}


class Blade(Section):
    """[blade]: the airfoil and the ring that it stands in."""

    n_blades: Whole = _key("blades of the ring", BLADES, ge=3, le=10000)
    hub_radius: Length = _key("radius of the root, m, clamped or on the rim of [disk]", LENGTH)
    length: Length = _key("hub to the outer surface of the shroud, m", LENGTH)
    chord: Length = _key("chord of the airfoil section, m", LENGTH)
    thickness: Length = _key("thickness of the airfoil section at the root, m", LENGTH)
    tip_thickness: Length | None = _key("thickness at the shroud, m; tapers linearly", LENGTH, None)
    twist: Number = _key(
        "rotation of the section from the root to the shroud about the radius, degrees",
        "a number, {bounds}",
        0.0,
        ge=-80.0,
        le=80.0,
    )
    section: Literal["rectangle", "lens"] = _key("shape of the section", "{words}", "rectangle")
    root_stagger: Number = _key(
        "angle from the engine axis to the chord at the root, degrees; the twist adds to it",
        "a number, {bounds}",
        0.0,
        ge=-80.0,
        le=80.0,
    )
    fillet_radius: Number = _key("radius of the fillet at the root, m; 0: none", FILLET, 0.0, ge=0.0, le=10.0)
    camber: Number = _key(
        "angle by which the camber line turns from edge to edge, degrees; above 0 it bulges towards +y",
        "a number, {bounds}",
        0.0,
        ge=-90.0,
        le=90.0,
    )


class Shroud(Section):
    """[shroud]: the platform at the tip, one pitch wide, with Z-shaped sides."""

    angle: Number = _key(
        "angle between the engine axis and the contact face, seen from the tip, degrees",
        "a number above 0, {bounds}",
        ge=1e-12,
        le=180.0,
    )
    thickness: Length = _key("radial thickness of the platform, m", LENGTH)
    axial_width: Length = _key("width of the platform along the engine axis, m", LENGTH)
    contact_length: Length = _key("length of the contact segment of the Z, m", LENGTH)
    gap: Number = _key("design gap between neighbours, circumferential, m", "a number, {bounds}", 0.0, ge=0.0, le=1.0)
    edge_angle: Literal["auto"] | Annotated[Number, Field(ge=-75.0, le=75.0)] = _key(
        "angle from the engine axis to the side edges, degrees, measured as the stagger; auto: 0 where the airfoil "
        "fits, else the one that leaves most room",
        'a number, {bounds}, or "auto"',
        "auto",
    )
    fillet_radius: Number = _key(
        "radius of the fillet between airfoil and platform, m; 0: none", FILLET, 0.0, ge=0.0, le=10.0
    )


class Snubber(Section):
    """[snubber]: wings on both sides of the airfoil out to the neighbours, around mid chord."""

    radius: Length = _key("mid radius, m", LENGTH)
    thickness: Length = _key("radial thickness, m", LENGTH)
    width: Length = _key("width of the contact face along the engine axis, m", LENGTH)
    angle: Number = _key(
        "angle between the engine axis and the contact face, measured as that of the shroud, degrees",
        "a number above 0, {below}, but not between 75 and 105",
        180.0,
        ge=1e-12,
        le=180.0,
    )
    gap: Number = _key("design gap between neighbours, circumferential, m", "a number, {bounds}", 0.0, ge=0.0, le=1.0)


class Platform(Section):
    """[platform]: platform near the root; a damper may lie under its two inclined flanks."""

    radius: Length = _key("mid radius, m", LENGTH)
    thickness: Length = _key("radial thickness at the airfoil, m", LENGTH)
    flank_angle: Number = _key(
        "inclination of the underside at both ends, degrees; 0: tangential to the ring",
        "a number, {bounds}",
        30.0,
        ge=0.0,
        le=75.0,
    )
    flank_length: Length | None = _key(
        "extent of a flank along the circumference, m; by default half the thickness is left at its end", LENGTH, None
    )
    width: Length | None = _key(
        "width along the engine axis at the ends, m; by default that of the airfoil", LENGTH, None
    )
    gap: Annotated[Number, Field(ge=0.0, le=1.0)] | None = _key(
        "gap between neighbours, circumferential, m; by default 2 % of the pitch", "a number, {bounds}", None
    )


class Damper(Section):
    """[damper]: a rigid body under the flanks of neighbouring platforms, which contacts alone hold."""

    mass: Positive = _key("mass, kg", POSITIVE)
    form: Literal["wedge", "cylinder"] = _key(
        "a wedge touches the flanks, a cylinder a line on each", "{words}", "wedge"
    )
    radius: Length | None = _key(
        "radius of its centre of mass, m; by default that of the form between the flanks", LENGTH, None
    )
    inertia: tuple[Positive, Positive, Positive] | None = _key(
        "moments of inertia about the engine axis, the circumference and the radius through its centre, kg m^2; by "
        "default those of the form between the flanks",
        "three numbers above 0, {bounds}",
        None,
    )
    axial_stiffness: NotNegative = _key(
        "stiffness of what locates it along the engine axis, N/m", "a number, {bounds}", 0.0
    )


class Rom(Section):
    """[rom]: Craig-Bampton reduction."""

    modes: Literal["auto"] | Annotated[Whole, Field(ge=1, le=1000)] | None = _key(
        'fixed-interface modes kept, or "auto": as many as the tolerance asks for',
        'a whole number, {bounds}, or "auto"',
        None,
    )
    frequency_limit: Positive | None = _key("keep every fixed-interface mode up to this, Hz", POSITIVE, None)
    contact_dofs: Literal["mortar", "patch", "nodal"] = _key(
        "displacements of the contact nodes: of the face projected on polynomials, averages over parts of the face, "
        "or displacements of mesh nodes",
        "{words}",
        "mortar",
    )
    tolerance: Number = _key(
        "largest relative error of frequencies and receptances in the frequency range",
        "a number from {bounds}",
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    nodal_diameters: Annotated[tuple[Annotated[Whole, Field(ge=0, le=5000)], ...], Field(min_length=1)] | None = _key(
        "nodal diameters of the waves whose motions of a disk's cut faces are kept; by default 0, 2, a quarter and "
        "half of the number of blades",
        "a list of whole numbers, {bounds}",
        None,
    )

    @property
    def fixed_interface_modes(self) -> int | Literal["auto"] | None:
        """Number of fixed-interface modes, the default where the scene says nothing; None with `frequency_limit`."""
        if self.modes is None and self.frequency_limit is None:
            return DEFAULT_MODES
        return self.modes


class Load(Section):
    """[load]: static loads."""

    speed_rpm: Number = _key(
        "rotational speed, rev/min; 0: no centrifugal load", "a number, {bounds}", 0.0, ge=0.0, le=1e6
    )
    equilibrium: Literal["nonlinear", "linear"] = _key(
        "static equilibrium at speed: at large displacements, or the quick linear one",
        "{words}",
        "nonlinear",
    )
    coriolis: Truth = _key(
        "whether Coriolis forces act in the vibration at speed, where the model has their matrix",
        "true or false",
        True,
    )
    force: tuple[StaticForce, ...] = _key("static forces", "tables [[load.force]]", ())
    pressure: tuple[Pressure, ...] = _key("static pressures", "tables [[load.pressure]]", ())
    temperature: Temperature | None = _key("temperature field", "a table [load.temperature]", None)

    def placed(self, folder: Path) -> Load:
        """The section with the full paths of its files, which are relative to the folder."""
        found: Load = placed(self, ("force", "temperature"), folder)
        return found


class Excitation(Section):
    """[excitation]: an engine order and its multiples, forces on a point or on loads of the blade."""

    engine_order: Whole = _key("engine order", "a whole number, {bounds}", ge=0, le=100000)
    force: Positive = _key("amplitude, N", POSITIVE)
    direction: Literal["x", "-x", "y", "-y", "z", "-z"] | Vector = _key(
        "direction of the force and of the default output",
        '"x", "y", "z", "-x", "-y", "-z" or a list of three numbers, {bounds}, not all 0',
        "y",
    )
    at: Literal["tip"] | Vector = _key(
        "loaded and observed point, m",
        '"tip" or a list of three numbers, {bounds}: x, y and z of a point of the blade',
        "tip",
    )

    harmonic: tuple[ExcitationHarmonic, ...] = _key(
        "multiples of the engine order that act as well", "tables [[excitation.harmonic]], each order once", ()
    )
    load: tuple[ExcitationLoad, ...] = _key(
        "where the force acts, in place of `at`", "tables [[excitation.load]]", ()
    )

    @field_validator("harmonic")
    @classmethod
    def _each_order_once(cls, value: Any) -> Any:
        orders = [item.order for item in value]
        if len(set(orders)) < len(orders):
            raise ValueError("tables [[excitation.harmonic]], each order once")
        return value

    @property
    def unit_direction(self) -> tuple[float, float, float]:
        """The direction as a vector of length 1 (three zeros where it is zero, which the checks refuse)."""
        return unit_vector(self.direction)

    @property
    def highest_harmonic(self) -> int:
        """The highest harmonic in which the excitation acts."""
        given = {item.order: item.amplitude for item in self.harmonic}
        acting = [h for h in {1, *given, *(item.harmonic for item in self.load)} if given.get(h, 1.0) != 0.0]
        return max(acting, default=1)

    def placed(self, folder: Path) -> Excitation:
        """The section with the full paths of its files, which are relative to the folder."""
        found: Excitation = placed(self, ("load",), folder)
        return found


class Response(Section):
    """[response]: which curve, how many harmonics, how much damping."""

    frequency: tuple[Positive, Positive] = _key(
        "range, Hz", "two numbers above 0, {bounds}, the second above the first"
    )
    harmonics: Annotated[Whole, Field(ge=1, le=99)] | Literal["auto"] = _key(
        "harmonics of the balance; auto: as many as the tolerance asks for", 'a whole number, {bounds}, or "auto"', 1
    )
    tolerance: Number = _key(
        "largest truncation error (neglected harmonics) that auto accepts, relative to the peak",
        "a number from {bounds}",
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    damping_ratio: Ratio | Annotated[tuple[Ratio, ...], Field(min_length=1)] | None = _key(
        "fraction of critical damping of each mode",
        "a number from {low}, below {high}, or a list of such numbers mode by mode (give this or rayleigh)",
        None,
    )
    rayleigh: tuple[NotNegative, NotNegative] | None = _key(
        "[a, b] of C = a M + b K, 1/s and s", "two numbers, {bounds}, not both 0 (give this or damping_ratio)", None
    )
    method: Literal["coupled", "static-first"] = _key(
        "statics and dynamics together, or a static contact analysis first", "{words}", "coupled"
    )
    stability: Literal["ring", "wave", "folds"] = _key(
        "Floquet exponents of every nodal diameter, of the wave only, or only the unstable part between folds",
        "{words}",
        "ring",
    )
    residual_tractions: Literal["projected", "bounds"] = _key(
        "traction of nodes that stick all the time: the paper's, or also the lowest and the highest peak it allows",
        "{words}",
        "projected",
    )
    detached: Truth = _key("whether detached branches (isolas) are looked for", "true or false", True)
    truncation: Truth = _key("whether the truncation error (neglected harmonics) is estimated", "true or false", True)
    search: Literal["off", "quick", "standard", "thorough"] = _key(
        "how far the worst motion is sought in time: 0, 0.25, 1 or 10 times the curve's cost", "{words}", "standard"
    )
    seed: Whole = _key("seed of the random states of that search", "a whole number, {bounds}", 0, ge=0, le=2**53 - 1)
    effort: Positive = _key("factor on the work that a curve may take before it is ended", POSITIVE, 1.0)


class Scene(Section):
    """A whole scene with one value for every key (one member of a sweep)."""

    name: str = _key(
        "name of the scene and of its output folder",
        "letters, digits, '.', '_' and '-', beginning with a letter or a digit, 64 at most",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
    )
    title: str = _key(
        "heading of the figures",
        "one line of text, 200 characters at most",
        "",
        max_length=200,
        pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]*$",
    )
    accuracy: Literal["draft", "standard", "reference"] | None = _key(
        "preset of mesh, modes, harmonics and tolerances; keys set in the scene override it",
        "{words}",
        None,
    )
    blade: Blade | None = _key("", "a table", None)
    shroud: Shroud | None = _key("", "a table", None)
    snubber: Snubber | None = _key("", "a table", None)
    platform: Platform | None = _key("", "a table", None)
    damper: Damper | None = _key("", "a table", None)
    disk: Disk | None = _key("", "a table", None)
    material: Material | None = _key("", "a table", None)
    materials: dict[str, NamedMaterial] = _key(
        "materials of a mesh from a file by name, of its materials, whose numbers these complete or replace, or of "
        "its element sets; of [disk]: materials.disk",
        "tables [materials.NAME]",
        {},
    )
    mesh: Mesh | None = _key("", "a table", None)
    model: Model | None = _key("", "a table", None)
    rom: Rom = _key("", "a table", Rom())
    load: Load = _key("", "a table", Load())
    aero: Aero | None = _key("", "a table", None)
    contact: Contact = _key("", "a table", NO_TABLE)
    interface: dict[str, Interface] = _key(
        "contact interfaces by name, those of the model, whose parameters differ from those in [contact]",
        "tables [interface.NAME]",
        {},
    )
    excitation: Excitation = _key("", "a table")
    response: Response = _key("", "a table")
    output: tuple[Output, ...] = _key(
        "quantities recorded beside the default output", "tables [[output]] with different names", ()
    )
    stress: Stress | None = _key("", "a table", None)
    fatigue: Fatigue | None = _key("", "a table", None)
    optimum: Optimum | None = _key("", "a table", None)
    map: Map | None = _key("", "a table", None)
    backbone: Backbone | None = _key("", "a table", None)
    flutter: Flutter | None = _key("", "a table", None)
    uncertainty: Uncertainty | None = _key("", "a table", None)
    mistuning: Mistuning | None = _key("", "a table", None)
    wear: Wear | None = _key("", "a table", None)
    render: Render | None = _key("", "a table", None)
    figures: Figures = _key("", "a table", Figures())

    _contents: Mapping[str, str] = PrivateAttr(default_factory=dict)
    _contact_of_a_file = model_validator(mode="before")(contact_unless_of_a_file)

    @field_validator("output")
    @classmethod
    def _different_names(cls, value: Any) -> Any:
        if len({item.name for item in value}) < len(value):
            raise ValueError("tables [[output]] with different names")
        for item in value:
            if not item.of_model and item.name in ("tip", "tip_x", "tip_y", "tip_z"):
                raise ValueError("tables [[output]] with other names than tip, tip_x, tip_y, tip_z")
        return value

    @property
    def contents(self) -> Mapping[str, str]:
        """Hashes of the input files when the scene was read; without those that could not be read."""
        return self._contents

    def aero_families(self) -> list[AeroFamily]:
        """The mode families that the flow acts on, with their coefficients, those of files among them."""
        return [] if self.aero is None else self.aero.scaled(self.contents)

    def aero_inputs(self) -> list[dict[str, Any]]:
        """What the flow is, whether it is given as lists or in files."""
        return [each.model_dump(exclude={"file"}, exclude_none=True) for each in self.aero_families()]

    def with_contents(self, contents: Mapping[str, str]) -> Scene:
        """The scene with hashes of its input files."""
        found = self.model_copy()
        found._contents = contents
        return found

    def table_of(self, interface: str) -> str:
        """NAME of the table [interface.NAME] with the parameters of an interface: its own, or that of the damper."""
        return DAMPER if interface in INTERFACES[DAMPER] and interface not in self.interface else interface

    def contact_of(self, interface: str) -> Contact:
        """The contact parameters of an interface: its own, and for keys that it does not give those of [contact]."""
        own = self.interface.get(self.table_of(interface))
        return self.contact if own is None else self.contact.model_copy(update=own.given)

    @property
    def laws(self) -> set[str]:
        """The friction laws of all interfaces."""
        return {self.contact.law, *(own.law for own in self.interface.values() if own.law is not None)}

    def section(self, table: str) -> Any:
        """The section of a table by its name, that of an interface as `contact_of`; None where there is none."""
        name = interface_of(f"{table}.")
        return self.contact_of(name) if name else getattr(self, table)

    @property
    def contacts(self) -> dict[str, Contact]:
        """[contact] and the contact parameters of every interface that has a table, by the name of the table."""
        return {CONTACT: self.contact} | {f"{INTERFACE}.{name}": self.contact_of(name) for name in self.interface}

    @property
    def punch_key(self) -> str:
        """The first key whose contact stiffness is to be computed as of a punch; empty where there is none."""
        for table, face in self.contacts.items():
            for name in ("normal_stiffness", "tangential_stiffness"):
                if getattr(face, name) == "punch":
                    return f"{table}.{name}"
        return ""

    @property
    def interfaces(self) -> tuple[str, ...] | None:
        """Names of the contact interfaces of a blade made here, or that [mesh] names; None: the model alone tells."""
        if self.mesh_file is not None and self.model is None and self.mesh is not None:
            return self.mesh.interfaces
        if self.blade is None or self.mesh_file is not None or self.model is not None:
            return None
        made = {section: names for section, names in INTERFACES.items() if getattr(self, section, None) is not None}
        return tuple(name for names in made.values() for name in names)

    @property
    def with_stress(self) -> bool:
        """Whether the stress on the mesh is asked for."""
        return self.stress is not None or self.fatigue is not None

    @property
    def has_damper(self) -> bool:
        """Whether a damper lies under the platforms."""
        return self.damper is not None

    @property
    def damper_touches(self) -> bool:
        """Whether a damper is not left out of the contact interfaces that touch."""
        chosen = self.contact.interfaces
        return self.has_damper and (chosen is None or bool(set(chosen) & set(INTERFACES[DAMPER])))

    @property
    def studies(self) -> tuple[str, ...]:
        """Names of the studies that the scene asks for."""
        return tuple(name for name in STUDIES if getattr(self, name) is not None)

    @property
    def mesh_file(self) -> str | None:
        """The mesh file that describes the blade; None where [blade] and [shroud] do, or nothing does."""
        return None if self.mesh is None else self.mesh.file

    @property
    def n_blades(self) -> int | None:
        """Blades of the ring; None for a scene without a blade."""
        if self.model is not None:
            return self.model.n_blades
        if self.mesh_file is not None and self.mesh is not None:
            return self.mesh.n_blades
        return None if self.blade is None else self.blade.n_blades


def _sections() -> Iterator[tuple[str, type[Section]]]:
    """Names and classes of the sections, those that a scene may lack among them."""
    for name, field in Scene.model_fields.items():
        asked: Any = field.annotation
        for kind in get_args(asked) if isinstance(asked, UnionType) else (asked,):
            if isinstance(kind, type) and issubclass(kind, Section):
                yield name, kind


SECTIONS = dict(_sections())


def section_class(table: str) -> type[Section]:
    """The class of a table by its name."""
    return Interface if interface_of(f"{table}.") else SECTIONS[table]


STUDIES = tuple(name for name, kind in SECTIONS.items() if issubclass(kind, StudyKeys))
NOT_SWEPT = ("stress", "fatigue", *STUDIES, "render", "figures")  # made of solved curves
NOT_SWEPT_KEYS = (  # tables, and lists of tables
    "disk.profile",
    "mesh.sets",
    "mesh.interface",
    "model.sets",
    "excitation.harmonic",
    "excitation.load",
    "load.force",
    "load.pressure",
    "load.temperature",
    "aero.family",
    "contact.interfaces",
)

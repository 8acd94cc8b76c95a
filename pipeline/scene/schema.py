"""The scene: all keys of a scene file, as frozen pydantic models. SI units, angles in degrees.

Every field says what it means with its unit (`description`) and what is allowed (`allowed`); error messages
quote the latter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, PrivateAttr, field_validator, model_validator

from pipeline.scene.aero_section import Aero, AeroFamily
from pipeline.scene.blade_section import DAMPER, INTERFACES, Blade, Damper, Disk, Platform, Shroud, Snubber
from pipeline.scene.contact_section import NO_TABLE, Contact, Interface, contact_unless_of_a_file
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, interface_of, of_contact
from pipeline.scene.fields import NOTHING_MORE, Meaning, Number, Section, StudyKeys, Truth, Whole, key, meaning_in
from pipeline.scene.loads_section import Excitation, Load, Output
from pipeline.scene.material_section import Fatigue, Material, NamedMaterial, Stress
from pipeline.scene.mesh_section import Mesh
from pipeline.scene.model_section import Model
from pipeline.scene.response_section import Response, Rom
from pipeline.studies.backbone.section import Backbone
from pipeline.studies.crossings.section import Crossings
from pipeline.studies.flutter.section import Flutter
from pipeline.studies.identify.section import Identify
from pipeline.studies.map.section import Map
from pipeline.studies.mistuning.section import Mistuning
from pipeline.studies.optimum.section import Optimum
from pipeline.studies.run_up.section import RunUp
from pipeline.studies.uncertainty.section import Uncertainty
from pipeline.studies.wear.section import Wear


class Render(Section):
    """[render]: pictures of mode shapes. Without this section they are drawn where asked for by name."""

    modes: Annotated[tuple[Annotated[Whole, Field(ge=1, le=100)], ...], Field(min_length=1, max_length=20)] = key(
        "mode shapes to draw, 1 is the lowest", (1, 2, 3), allowed="a list of {count} whole numbers, {bounds}"
    )
    deformation: Number = key(
        "largest drawn displacement as a fraction of the blade's length", 0.08, ge=1e-12, le=1.0
    )
    contact: Literal["free", "sliding", "stuck"] = key("how the shrouds are joined", "free")
    operating: Truth | Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=20)] = key(
        "motion at the peak; true: of the curves with the highest and the lowest peak",
        False,
        allowed="true, false or a list of {count} numbers of curves, the first is 0",
    )
    blades: Whole = key("neighbours drawn side by side", 3, ge=1, le=9)


class Figures(Section):
    """[figures]: files that the figures are written to."""

    formats: Annotated[tuple[Literal["png", "svg"], ...], Field(min_length=1)] = key(
        "formats of every figure", ("png",), allowed='a list of "png", "svg" or both'
    )
    bifurcations: Truth = key("whether the response figure marks bifurcations but folds", False)


class Scene(Section):
    """A whole scene with one value for every key (one member of a sweep)."""

    name: str = key(
        "name of the scene and of its output folder",
        allowed="letters, digits, '.', '_' and '-', beginning with a letter or a digit, 64 at most",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
    )
    title: str = key(
        "heading of the figures",
        "",
        allowed="one line of text, 200 characters at most",
        max_length=200,
        pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]*$",
    )
    accuracy: Literal["draft", "standard", "reference"] | None = key(
        "preset of mesh, modes, harmonics and tolerances; keys set in the scene override it", None
    )
    blade: Annotated[Blade | None, Meaning(role="design")] = key("", None)
    shroud: Annotated[Shroud | None, Meaning(role="design")] = key("", None)
    snubber: Annotated[Snubber | None, Meaning(role="design")] = key("", None)
    platform: Annotated[Platform | None, Meaning(role="design")] = key("", None)
    damper: Annotated[Damper | None, Meaning(role="design")] = key("", None)
    disk: Annotated[Disk | None, Meaning(role="design")] = key("", None)
    material: Annotated[Material | None, Meaning(role="design")] = key("", None)
    materials: dict[str, NamedMaterial] = key(
        "materials of a mesh from a file by name, of its materials, whose numbers these complete or replace, or of "
        "its element sets; of [disk]: materials.disk",
        {},
        allowed="tables [materials.NAME]",
    )
    mesh: Mesh | None = key("", None)
    model: Annotated[Model | None, Meaning(role="design")] = key("", None)
    rom: Rom = key("", Rom())
    load: Annotated[Load, Meaning(role="condition")] = key("", Load())
    aero: Annotated[Aero | None, Meaning(role="condition")] = key("", None)
    contact: Contact = key("", NO_TABLE)
    interface: dict[str, Interface] = key(
        "contact interfaces by name, those of the model, whose parameters differ from those in [contact]",
        {},
        allowed="tables [interface.NAME]",
    )
    excitation: Annotated[Excitation, Meaning(role="condition")] = key("")
    response: Response = key("")
    output: tuple[Output, ...] = key(
        "quantities recorded beside the default output", (), allowed="tables [[output]] with different names"
    )
    stress: Stress | None = key("", None)
    fatigue: Fatigue | None = key("", None)
    optimum: Optimum | None = key("", None)
    map: Map | None = key("", None)
    backbone: Backbone | None = key("", None)
    flutter: Flutter | None = key("", None)
    uncertainty: Uncertainty | None = key("", None)
    mistuning: Mistuning | None = key("", None)
    wear: Wear | None = key("", None)
    run_up: RunUp | None = key("", None)
    identify: Identify | None = key("", None)
    crossings: Crossings | None = key("", None)
    render: Render | None = key("", None)
    figures: Figures = key("", Figures())

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
MEANINGS = {  # what is known of dotted keys, of which more is known than their values
    f"{table}.{name}": meaning
    for table, kind in SECTIONS.items()
    for name in kind.model_fields
    if (meaning := meaning_in(kind, name)) is not NOTHING_MORE
}
NOT_SWEPT_KEYS = tuple(key for key, meaning in MEANINGS.items() if not meaning.swept)  # tables, and lists of tables


def meaning_of(key: str) -> Meaning:
    """What is known of a dotted key; of one of an interface what is known of that of [contact]."""
    return MEANINGS.get(of_contact(key), NOTHING_MORE)


def has_role(key: str, role: Literal["design", "condition"]) -> bool:
    """Whether the value of a key is chosen by a designer, or is a condition that a machine meets.

    An optimum holds under all conditions that are swept. What has no role is a setting of the computation.
    """
    table = key.partition(".")[0]
    own = meaning_of(key).role or (meaning_in(Scene, table).role if table in Scene.model_fields else "")
    return own == role

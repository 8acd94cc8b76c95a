"""The sections of a blade made here: [blade], [shroud], [snubber], [platform], [damper] and [disk]."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.scene.fields import (
    DEGREES,
    PER_METRE,
    SMALL_LENGTH,
    Length,
    Meaning,
    NotNegative,
    Number,
    Positive,
    Section,
    Usual,
    Whole,
    allowed_of,
    key,
    metres,
)
from pipeline.scene.loads_section import File
from pipeline.scene.mesh_section import MAIN_INTERFACE

Thickness = Annotated[Length, metres(1e-4, 0.5, 2.0)]
Width = Annotated[Length, metres(1e-4, 1.0, 10.0)]
Radius = Annotated[Length, metres(0.01, 13.0, 130.0)]
AxialWidth = Annotated[Length, metres(1e-3, 2.0, 20.0)]
Gap = Annotated[Number, Field(ge=0.0, le=1.0), SMALL_LENGTH]
Fillet = Annotated[Number, Field(ge=0.0, le=10.0)]
Stagger = Annotated[Number, Field(ge=-80.0, le=80.0)]
FaceAngle = Annotated[Number, Field(ge=1e-12, le=180.0)]
OF_AIRFOIL = (  # keys of [blade] in place of its sections
    "chord",
    "thickness",
    "tip_thickness",
    "twist",
    "section",
    "root_stagger",
    "fillet_radius",
    "camber",
)
DAMPER = "damper"
INTERFACES = {  # contact interfaces that the sections of a blade made here make
    "shroud": (MAIN_INTERFACE,),
    "snubber": ("snubber",),
    DAMPER: ("damper_right", "damper_left"),
}


class Blade(Section):
    """[blade]: the airfoil and the ring that it stands in."""

    n_blades: Annotated[Whole, Meaning(words="nb nblades blades numberofblades", discrete=True)] = key(
        "blades of the ring", ge=3, le=10000
    )
    hub_radius: Annotated[Length, metres(0.01, 10.0, 100.0, words="radius rhub")] = key(
        "radius of the root, m, clamped or on the rim of [disk]"
    )
    length: Annotated[Length, metres(0.005, 3.0, 30.0, "blade length", words="span height")] = key(
        "from the hub to the outer surface of the shroud, m"
    )
    sections: Annotated[File | None, Meaning(swept=False)] = key(
        "sections of the airfoil as points, a CSV file in place of the keys that follow; relative to the scene file",
        None,
    )
    chord: Annotated[Length | None, metres(1e-3, 1.0, 10.0, "chord")] = key(
        "chord of the airfoil section, m; required without sections", None, validate_default=True
    )
    thickness: Annotated[Length | None, metres(1e-4, 0.5, 2.0, "blade thickness")] = key(
        "thickness of the airfoil section at the root, m; required without sections", None, validate_default=True
    )
    tip_thickness: Thickness | None = key(
        "thickness at the shroud, m; tapers linearly; by default as at the root", None
    )
    twist: Annotated[Stagger, Meaning("degrees", "twist", Usual(1.6, 80.0, DEGREES))] = key(
        "rotation of the section from root to shroud, degrees: the stagger there is root_stagger + twist", 0.0
    )
    section: Literal["rectangle", "lens"] = key("shape of the section", "rectangle")
    root_stagger: Annotated[Stagger, Meaning("degrees", "root stagger", words="stagger")] = key(
        "stagger at the root, degrees: angle from the engine axis to the chord, from x towards y", 0.0
    )
    fillet_radius: Annotated[Fillet, metres(1e-6, 0.1, 1.0, "fillet at the root")] = key(
        "radius of the fillet at the root, m; 0: none", 0.0
    )
    camber: Annotated[Number, Meaning("degrees", "camber", Usual(1.6, 90.0, DEGREES))] = key(
        "angle by which the camber line, a circular arc, turns from edge to edge, degrees; above 0 it bulges "
        "towards +y",
        0.0,
        ge=-90.0,
        le=90.0,
    )

    @field_validator(*OF_AIRFOIL)
    @classmethod
    def _of_a_parametric_airfoil(cls, value: Any, info: ValidationInfo) -> Any:
        """Chord and thickness are needed without sections; beside them nothing else is given of the airfoil."""
        if "sections" not in info.data:
            return value
        if info.data["sections"] is None and value is None and info.field_name in ("chord", "thickness"):
            raise ValueError(allowed_of(cls, info.field_name))
        if info.data["sections"] is not None and value != cls.model_fields[info.field_name or ""].default:
            raise ValueError("nothing beside blade.sections, which give the airfoil")
        return value


class Shroud(Section):
    """[shroud]: the platform at the tip, one pitch wide, with Z-shaped sides."""

    angle: Annotated[
        FaceAngle,
        Meaning("degrees", "shroud angle", Usual(3.2, 180.0, DEGREES), words="alpha shroudangle contactangle"),
    ] = key(
        "angle between the engine axis and the contact face, seen from the tip, degrees; 180: straight sides, 90: "
        "contact normal along the axis"
    )
    thickness: Thickness = key("radial thickness of the platform, m")
    axial_width: AxialWidth = key("width of the platform along the engine axis, m")
    contact_length: Annotated[Length, metres(1e-4, 1.0, 10.0, "contact length", words="lc")] = key(
        "length of the contact segment of the Z, m"
    )
    gap: Gap = key("design gap between neighbours, circumferential, m", 0.0)
    edge_angle: Annotated[
        Literal["auto"] | Annotated[Number, Field(ge=-75.0, le=75.0)], Meaning("degrees", "edge angle")
    ] = key(
        "slant of the side edges: angle from the engine axis, measured as the stagger, degrees; auto: 0 where the "
        "airfoil fits, else the one that leaves most room",
        "auto",
    )
    fillet_radius: Annotated[Fillet, metres(1e-6, 0.1, 1.0, "fillet at the shroud")] = key(
        "radius of the fillet between airfoil and platform, where its footprint must fit, m; 0: none", 0.0
    )


class Snubber(Section):
    """[snubber]: wings on both sides of the airfoil out to the neighbours, around mid chord."""

    radius: Radius = key("mid radius, m, between root and shroud, off their fillets")
    thickness: Thickness = key("radial thickness, m")
    width: Width = key(
        "width of the contact face along the engine axis, m; at the airfoil the nearest columns of elements"
    )
    angle: Annotated[FaceAngle, Meaning("degrees", usual=Usual(3.2, 180.0, DEGREES))] = key(
        "angle between the engine axis and the contact face, measured as that of the shroud, degrees; a snubber "
        "has no Z",
        180.0,
        allowed="a number above 0, {below}, but not between 75 and 105",
    )
    gap: Gap = key("design gap between neighbours, circumferential, m", 0.0)


class Platform(Section):
    """[platform]: platform near the root; a damper may lie under its two inclined flanks."""

    radius: Radius = key("mid radius, m, between root and shroud, off their fillets")
    thickness: Thickness = key("radial thickness at the airfoil, m")
    flank_angle: Annotated[Number, Meaning("degrees")] = key(
        "inclination of the flanks, degrees; 0: tangential to the ring, with the normal towards the hub",
        30.0,
        ge=0.0,
        le=75.0,
    )
    flank_length: Width | None = key(
        "extent of a flank along the circumference, m; by default half the thickness is left at its end, at most "
        "the thickness",
        None,
    )
    width: Width | None = key(
        "width along the engine axis at both ends, m; by default that of the airfoil, from edge to edge", None
    )
    gap: Gap | None = key("gap between neighbours, circumferential, m; by default 2 % of the pitch", None)


class Damper(Section):
    """[damper]: a rigid body under the flanks of neighbouring platforms, which contacts alone hold."""

    mass: Annotated[
        Positive,
        Meaning(
            "kg",
            "damper mass",
            Usual(1e-5, 1.0, "the key is in kg", 1e-9, 100.0),
            shown=("g", 1e3),
            uncertain=True,
            decades=1.0,
        ),
    ] = key("mass, kg")
    form: Literal["wedge", "cylinder"] = key(
        "a wedge touches both flanks at the contact nodes, a cylinder the middle line of each", "wedge"
    )
    radius: Radius | None = key(
        "radius of its centre of mass, m; by default that of the form between the flanks", None
    )
    inertia: Annotated[tuple[Positive, Positive, Positive] | None, Meaning("kg m^2")] = key(
        "moments of inertia about the engine axis, the circumference and the radius through its centre, kg m^2; "
        "by default those of the form, of uniform density",
        None,
        allowed="three numbers above 0, {bounds}",
    )
    axial_stiffness: Annotated[NotNegative, Meaning("N/m", usual=Usual(1.0, 1e12, PER_METRE))] = key(
        "stiffness of what locates it along the engine axis, N/m: where both flanks slip all the time, friction "
        "alone does not",
        0.0,
    )


class Disk(Section):
    """[disk]: the disk that carries the blades; without it each blade is clamped at its root."""

    bore_radius: Annotated[Length, metres(1e-3, 10.0, 100.0)] = key("inner radius, m")
    rim_width: AxialWidth = key("axial width at blade.hub_radius, m; the root of the airfoil must fit on it")
    bore_width: AxialWidth | None = key(
        "axial width at the bore, m; by default that of the rim, linear between them", None
    )
    profile: Annotated[tuple[tuple[Length, Length], ...], Meaning("m", swept=False)] = key(
        "[radius, axial width], m, at further radii between bore and rim, ascending",
        (),
        allowed="a list of [radius, width], two numbers above 0, {bounds}, with ascending radii",
    )
    bore: Literal["clamped", "free"] = key("whether the bore is held", "clamped")
    size: Annotated[Length | None, Meaning("m")] = key(
        "length of the elements along the radius at the bore, m; by default three times mesh.size", None
    )

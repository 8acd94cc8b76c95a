"""The sections of a blade made here: [blade], [shroud], [snubber], [platform], [damper] and [disk]."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import (
    BLADES,
    FILLET,
    LENGTH,
    POSITIVE,
    Length,
    NotNegative,
    Number,
    Positive,
    Section,
    Whole,
    key,
)
from pipeline.scene.mesh_section import MAIN_INTERFACE

DAMPER = "damper"
INTERFACES = {  # contact interfaces that the sections of a blade made here make
    "shroud": (MAIN_INTERFACE,),
    "snubber": ("snubber",),
    DAMPER: ("damper_right", "damper_left"),
}


class Blade(Section):
    """[blade]: the airfoil and the ring that it stands in."""

    n_blades: Whole = key("blades of the ring", BLADES, ge=3, le=10000)
    hub_radius: Length = key("radius of the root, m, clamped or on the rim of [disk]", LENGTH)
    length: Length = key("hub to the outer surface of the shroud, m", LENGTH)
    chord: Length = key("chord of the airfoil section, m", LENGTH)
    thickness: Length = key("thickness of the airfoil section at the root, m", LENGTH)
    tip_thickness: Length | None = key("thickness at the shroud, m; tapers linearly", LENGTH, None)
    twist: Number = key(
        "rotation of the section from the root to the shroud about the radius, degrees",
        "a number, {bounds}",
        0.0,
        ge=-80.0,
        le=80.0,
    )
    section: Literal["rectangle", "lens"] = key("shape of the section", "{words}", "rectangle")
    root_stagger: Number = key(
        "angle from the engine axis to the chord at the root, degrees; the twist adds to it",
        "a number, {bounds}",
        0.0,
        ge=-80.0,
        le=80.0,
    )
    fillet_radius: Number = key("radius of the fillet at the root, m; 0: none", FILLET, 0.0, ge=0.0, le=10.0)
    camber: Number = key(
        "angle by which the camber line turns from edge to edge, degrees; above 0 it bulges towards +y",
        "a number, {bounds}",
        0.0,
        ge=-90.0,
        le=90.0,
    )


class Shroud(Section):
    """[shroud]: the platform at the tip, one pitch wide, with Z-shaped sides."""

    angle: Number = key(
        "angle between the engine axis and the contact face, seen from the tip, degrees",
        "a number above 0, {bounds}",
        ge=1e-12,
        le=180.0,
    )
    thickness: Length = key("radial thickness of the platform, m", LENGTH)
    axial_width: Length = key("width of the platform along the engine axis, m", LENGTH)
    contact_length: Length = key("length of the contact segment of the Z, m", LENGTH)
    gap: Number = key("design gap between neighbours, circumferential, m", "a number, {bounds}", 0.0, ge=0.0, le=1.0)
    edge_angle: Literal["auto"] | Annotated[Number, Field(ge=-75.0, le=75.0)] = key(
        "angle from the engine axis to the side edges, degrees, measured as the stagger; auto: 0 where the airfoil "
        "fits, else the one that leaves most room",
        'a number, {bounds}, or "auto"',
        "auto",
    )
    fillet_radius: Number = key(
        "radius of the fillet between airfoil and platform, m; 0: none", FILLET, 0.0, ge=0.0, le=10.0
    )


class Snubber(Section):
    """[snubber]: wings on both sides of the airfoil out to the neighbours, around mid chord."""

    radius: Length = key("mid radius, m", LENGTH)
    thickness: Length = key("radial thickness, m", LENGTH)
    width: Length = key("width of the contact face along the engine axis, m", LENGTH)
    angle: Number = key(
        "angle between the engine axis and the contact face, measured as that of the shroud, degrees",
        "a number above 0, {below}, but not between 75 and 105",
        180.0,
        ge=1e-12,
        le=180.0,
    )
    gap: Number = key("design gap between neighbours, circumferential, m", "a number, {bounds}", 0.0, ge=0.0, le=1.0)


class Platform(Section):
    """[platform]: platform near the root; a damper may lie under its two inclined flanks."""

    radius: Length = key("mid radius, m", LENGTH)
    thickness: Length = key("radial thickness at the airfoil, m", LENGTH)
    flank_angle: Number = key(
        "inclination of the underside at both ends, degrees; 0: tangential to the ring",
        "a number, {bounds}",
        30.0,
        ge=0.0,
        le=75.0,
    )
    flank_length: Length | None = key(
        "extent of a flank along the circumference, m; by default half the thickness is left at its end", LENGTH, None
    )
    width: Length | None = key(
        "width along the engine axis at the ends, m; by default that of the airfoil", LENGTH, None
    )
    gap: Annotated[Number, Field(ge=0.0, le=1.0)] | None = key(
        "gap between neighbours, circumferential, m; by default 2 % of the pitch", "a number, {bounds}", None
    )


class Damper(Section):
    """[damper]: a rigid body under the flanks of neighbouring platforms, which contacts alone hold."""

    mass: Positive = key("mass, kg", POSITIVE)
    form: Literal["wedge", "cylinder"] = key(
        "a wedge touches the flanks, a cylinder a line on each", "{words}", "wedge"
    )
    radius: Length | None = key(
        "radius of its centre of mass, m; by default that of the form between the flanks", LENGTH, None
    )
    inertia: tuple[Positive, Positive, Positive] | None = key(
        "moments of inertia about the engine axis, the circumference and the radius through its centre, kg m^2; by "
        "default those of the form between the flanks",
        "three numbers above 0, {bounds}",
        None,
    )
    axial_stiffness: NotNegative = key(
        "stiffness of what locates it along the engine axis, N/m", "a number, {bounds}", 0.0
    )


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

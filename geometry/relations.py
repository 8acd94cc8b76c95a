"""Limits of one parameter that depend on others."""

from math import pi

from geometry.parameters import LARGEST_STAGGER, BladeParameters, ShroudParameters
from geometry.planform import mid_radius


def broken_relation(blade: BladeParameters, shroud: ShroudParameters) -> tuple[str, str, str] | None:
    """Table and name of the first parameter beyond a limit set by others, and the reason; None where all hold."""
    pitch = 2 * pi * mid_radius(blade, shroud) / blade.n_blades
    span = blade.length - shroud.thickness
    fillets = blade.fillet_radius + shroud.fillet_radius
    larger_fillet = "blade" if blade.fillet_radius >= shroud.fillet_radius else "shroud"
    turned = f"the chord at the shroud, turned by {blade.tip_stagger:g} degrees, must stay within {LARGEST_STAGGER:g}"
    chord = f"must be less than the chord ({blade.chord:g} m)"
    relations = [
        (abs(blade.tip_stagger) <= LARGEST_STAGGER, "blade", "twist", turned),
        (blade.thickness < blade.chord, "blade", "thickness", chord),
        ((blade.tip_thickness or 0.0) < blade.chord, "blade", "tip_thickness", chord),
        (span > 0, "shroud", "thickness", f"must be less than the blade's length ({blade.length:g} m)"),
        (
            shroud.gap <= pitch / 2,
            "shroud",
            "gap",
            f"must be at most half the pitch at the shroud ({pitch / 2:.6g} m)",
        ),
        (
            fillets <= span / 2,
            larger_fillet,
            "fillet_radius",
            "the two fillets take up more than half of the airfoil",
        ),
    ]
    return next(((table, name, reason) for holds, table, name, reason in relations if not holds), None)

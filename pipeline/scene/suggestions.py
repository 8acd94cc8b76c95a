"""What a user may have meant by a key that a scene does not have."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence

from pipeline.scene.schema import SECTIONS

# symbols and other words of the field -> dotted key; compared without case, "_" and "-"
MEANINGS = {
    "blade.n_blades": "nb nblades blades numberofblades",
    "blade.hub_radius": "radius rhub",
    "blade.length": "span height",
    "blade.root_stagger": "stagger",
    "shroud.angle": "alpha shroudangle contactangle",
    "shroud.contact_length": "lc",
    "material.young_modulus": "e young youngsmodulus elasticmodulus modulus",
    "material.poisson_ratio": "nu poisson poissonsratio",
    "material.density": "rho",
    "mesh.size": "elementsize meshsize",
    "rom.modes": "nmodes",
    "load.speed_rpm": "rpm speed omega rotation rotationalspeed",
    "contact.friction": "mu frictioncoefficient coefficientoffriction",
    "contact.normal_stiffness": "kn stiffness",
    "contact.tangential_stiffness": "kt",
    "contact.interference": "v0 gap initialgap",
    "contact.preload": "n0 normalload",
    "excitation.engine_order": "eo order engineorders",
    "excitation.force": "f0 amplitude forceamplitude",
    "response.frequency": "freq frequencies range frequencyrange",
    "response.harmonics": "nh nharmonics",
    "response.damping_ratio": "zeta xi damping dampingfactor",
}
_BY_WORD = {word: key for key, words in MEANINGS.items() for word in words.split()}


MOST_LISTED = 12  # keys in a message; of more only the nearest
_NEAREST = 4


def meant(
    key: str,
    known: Sequence[str],
    section: str = "",
    inside: Collection[str] | None = None,
    tables: Collection[str] = (),
) -> str:
    """The key of a scene that an unknown one may stand for; empty where nothing is near."""
    if inside is not None and not section:
        alike = [name for name, model in SECTIONS.items() if inside and set(inside) <= set(model.model_fields)]
        alike.sort(key=lambda name: name in tables)
        return next(iter([*difflib.get_close_matches(key, list(SECTIONS), n=1, cutoff=0.75), *alike]), "")
    place = f"{section}." if section in SECTIONS else ""
    name = key.rpartition(".")[2]
    word = _BY_WORD.get(name.lower().replace("_", "").replace("-", ""), "")
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    elsewhere = [f"{table}.{name}" for table, model in SECTIONS.items() if name in model.model_fields]
    elsewhere.sort(key=lambda each: each.partition(".")[0] not in tables)
    if any("." in each for each in known):  # of dotted keys, as in [sweep], only these help
        near = [each for each in [word, *near, *elsewhere] if each in known]
        return near[0] if near else ""
    return word or [*elsewhere, *(place + each for each in near), ""][0]


def listed(known: Sequence[str], key: str, near: str = "") -> str:
    """The keys that there are, for a message about an unknown one; of many only the nearest, or the tables."""
    if len(known) <= MOST_LISTED:
        return ", ".join(known)
    if near and near not in known:
        return near
    closest = difflib.get_close_matches(near or key, known, n=_NEAREST, cutoff=0.6)
    if closest:
        return f"{', '.join(closest)} and others"
    tables = dict.fromkeys(each.partition(".")[0] for each in known)
    return ", ".join(tables) if len(tables) == len(known) else f"keys of {', '.join(tables)}"

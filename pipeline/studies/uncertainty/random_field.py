"""A quantity that varies at random over a contact face: a Gaussian field by its Karhunen-Loeve modes.

The field g has mean 0, variance 1 and the correlation exp(-(d / l)^2) of nodes at the distance d, l the correlation
length. With the eigenvectors phi_m and eigenvalues lambda_m of the correlation matrix of the nodes,

    g = sum_m sqrt(lambda_m) phi_m xi_m,

with independent standard normal xi_m. The quantity at a node is the quantile of its distribution at the probability
Phi(g): every node has the distribution of the parameter (a translation process).

References
----------
R. G. Ghanem, P. D. Spanos, Stochastic Finite Elements: A Spectral Approach, Springer, 1991.
M. Grigoriu, "Crossings of non-Gaussian translation processes", Journal of Engineering Mechanics 110 (1984) 610-620.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.blade_section import DAMPER
from pipeline.scene.dotted_keys import INTERFACE, interface_of, of_contact, split_key
from pipeline.scene.schema import Scene
from pipeline.scene.sweep import SHIFTED, key_value
from pipeline.stages.scene_to_solver import contact_parameters, resolved_contacts
from pipeline.studies.study import StudyError
from pipeline.studies.uncertainty.section import Marginal, UncertainParameter, marginal_of

Array = NDArray[np.float64]
LEFT_OUT = 0.01  # of the variance, by modes that are neglected
FARTHEST = 8.0  # standard deviations of a coordinate


def karhunen_loeve(position: Array, length: float) -> Array:
    """sqrt(lambda_m) phi_m of the field at nodes (n, 3), m, as (n, r): all but 1 % of the variance, then made 1."""
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    values, vectors = np.linalg.eigh(np.exp(-((distance / length) ** 2)))
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    kept = 1 + int(np.searchsorted(np.cumsum(values), (1.0 - LEFT_OUT) * values.sum()))
    modes = vectors[:, :kept] * np.sqrt(values[:kept])
    return np.asarray(modes / np.linalg.norm(modes, axis=1, keepdims=True))


@dataclass(frozen=True)
class RandomField:
    """An uncertain key whose value varies at random over a face."""

    key: str  # the key, of one interface where there are several
    marginal: Marginal  # distribution of the value at each node, in the units of the key
    modes: Array  # (n, r), sqrt(lambda_m) phi_m
    # values (n,) of the nodes = base + slope * (value - centre)
    base: Array
    slope: Array

    @property
    def coordinates(self) -> list[Marginal]:
        """Distributions of the xi_m."""
        names = [f"{self.key} mode {m + 1}" for m in range(self.modes.shape[1])]
        return [Marginal(name, "normal", 0.0, 1.0, -FARTHEST, FARTHEST) for name in names]

    def values(self, coordinates: Sequence[float]) -> list[float]:
        """The values of the nodes at some xi_m."""
        from scipy.special import ndtr

        found = self.marginal.quantile(ndtr(self.modes @ np.asarray(coordinates)))
        return np.asarray(self.base + self.slope * (found - self.marginal.centre)).tolist()


def random_field(item: UncertainParameter, scene: Scene, rom: Path) -> RandomField:
    """The field of a parameter with a correlation length; the scene's own value gives its mean at each node."""
    from rom.files.reduced_model_file import read_reduced_model
    from rom.reduction.contact_dofs import ContactNodes

    assert item.correlation_length is not None
    nodes = ContactNodes.of(read_reduced_model(rom, with_basis=False)).split()
    name = interface_of(item.key) or next(iter(nodes))
    if name not in nodes or (len(nodes) > 1 and not interface_of(item.key)):
        keys = ", ".join(f"{INTERFACE}.{each}.{split_key(item.key)[1]}" for each in nodes)
        raise StudyError(f"{item.key}: a random field over several interfaces, allowed: {keys}")
    if DAMPER in scene.interface and name.startswith(DAMPER):
        raise StudyError(
            f"{item.key}: beside [{INTERFACE}.{DAMPER}], allowed: a table for each interface of the damper"
        )
    own, key = nodes[name], split_key(item.key)[1]
    mean = key_value(scene, item.key) or 0.0
    marginal = marginal_of(item, mean)

    def at_nodes(contact_scene: Scene) -> Array:
        (found,) = resolved_contacts(contact_scene, own)
        return np.asarray(getattr(contact_parameters([found], own.area), key))

    base = at_nodes(scene)
    slope = np.ones(len(base))
    if of_contact(item.key) not in SHIFTED:
        unit = scene.contact_of(name).model_copy(update={key: 1.0})
        alone = scene.model_copy(update={"contact": unit, "interface": {}})
        slope = base / mean if mean else at_nodes(alone)
        base = base * (marginal.centre / mean) if mean else slope * marginal.centre
    else:
        base = base + marginal.centre - mean
    return RandomField(item.key, marginal, karhunen_loeve(own.position, item.correlation_length), base, slope)

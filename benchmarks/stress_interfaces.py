"""Random blades with one to three contact interfaces of all kinds: `benchmarks/stress.py --interfaces`.

A blade is a chain of four masses from the hub to the tip with light contact nodes on it. Interfaces lie between
neighbours, inside the sector and against the ground; each has its own nodes, stiffness, gap and friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from stress_cases import TANGENTIAL_RATIO, Law

if TYPE_CHECKING:
    from nonlinear import ContactParameters, Excitation, SolverOptions
    from rom import ModalModel, ReducedModel

Array = NDArray[np.float64]
KINDS = ("between neighbours", "inside the sector", "against the ground")
MASSES, STIFFNESS = 4, 4e6  # of a blade, the latter of one spring, N/m: the first mode near 100 Hz
NODE_MASS, NODE_STIFFNESS = 0.01, 40.0  # of a contact node, the latter relative to a spring of the blade
STIFFNESS_RANGE = (1e4, 1e9)  # of an interface, N/m
BELOW_FREE, ABOVE_STUCK = 0.8, 1.2


@dataclass(frozen=True)
class InterfaceCase:
    """One curve: everything follows from the seed and the index.

    The two friction laws take turns, in each fifth case by interface.
    """

    seed: int
    index: int

    def law(self, interface: int = 0) -> Law:
        """The friction law of an interface."""
        turn = self.index + interface * (self.index % 5 == 4)
        return "cone" if turn % 2 else "two_sliders"

    @property
    def replay(self) -> str:
        """The command that solves this case again and draws its curve."""
        return f"python benchmarks/stress.py --interfaces --replay {self.index} --seed {self.seed} --draw"

    def values(self) -> dict[str, Any]:
        """Column -> value."""
        drawn = self.drawn()
        return {"seed": self.seed, "index": self.index} | {
            "law": "; ".join(self.law(k) for k in range(len(drawn.interfaces))),
            "interfaces": "; ".join(f"{i.kind}, {i.nodes} nodes, kn {i.stiffness:.3g} N/m" for i in drawn.interfaces),
            "interference_m": "; ".join(f"{i.interference:.3g}" for i in drawn.interfaces),
            "friction": "; ".join(f"{i.friction:g}" for i in drawn.interfaces),
            "blades": drawn.n_blades,
            "engine_order": drawn.engine_order,
            "damping_ratio": drawn.damping_ratio,
            "harmonics": drawn.harmonics,
        }

    def drawn(self) -> Drawn:
        """The numbers of the case."""
        rng = np.random.default_rng((self.seed, self.index))
        n_blades = int(rng.choice((4, 6, 12, 36)))
        damping = float(rng.choice((1e-3, 3e-3, 2e-2)))
        free = 1.0 / (2.0 * damping * STIFFNESS / MASSES)  # about the free amplitude under 1 N, m
        interfaces = []
        for _ in range(int(rng.integers(1, 4))):
            low, high = np.log10(STIFFNESS_RANGE)
            distance = float(rng.choice((-1.0, 0.0, 1.0)) * free * 10.0 ** rng.uniform(-2.5, 0.0))
            stiffness = float(10.0 ** rng.uniform(low, high))
            friction = float(rng.choice((0.0, 0.1, 0.5, 1.0)))
            interfaces.append(
                DrawnInterface(str(rng.choice(KINDS)), int(rng.integers(1, 4)), stiffness, distance, friction)
            )
        order, harmonics = int(rng.integers(0, n_blades // 2 + 1)), int(rng.choice((1, 3, 5)))
        return Drawn(tuple(interfaces), n_blades, order, damping, harmonics, int(rng.integers(2**31)))

    def posed(self) -> tuple[ModalModel, ContactParameters, Excitation, SolverOptions]:
        """The arguments of `forced_response`, under 1 N."""
        from nonlinear import ContactParameters, Excitation, SolverOptions
        from rom import inter_blade_phase, modal_model, natural_frequencies

        drawn = self.drawn()
        model = blade(drawn)
        contact = ContactParameters.joined(
            *(
                ContactParameters.shared(
                    each.nodes,
                    normal_stiffness=each.stiffness,
                    tangential_stiffness=TANGENTIAL_RATIO * each.stiffness,
                    friction=each.friction,
                    interference=each.interference,
                    law=self.law(k),
                )
                for k, each in enumerate(drawn.interfaces)
            )
        )
        phase = inter_blade_phase(drawn.engine_order, drawn.n_blades)
        springs = {"normal": contact.normal_stiffness, "tangential": contact.tangential_stiffness}
        free = float(natural_frequencies(model, phase, count=1)[0])
        stuck = float(natural_frequencies(model, phase, count=1, **springs)[0])
        modal = modal_model(model, damping_ratio=drawn.damping_ratio)
        options = SolverOptions((BELOW_FREE * free, ABOVE_STUCK * stuck), harmonics=drawn.harmonics)
        return modal, contact, Excitation(drawn.engine_order, 1.0), options


@dataclass(frozen=True)
class DrawnInterface:
    """One interface of a case, SI units."""

    kind: str
    nodes: int
    stiffness: float  # kn of the whole interface
    interference: float
    friction: float


@dataclass(frozen=True)
class Drawn:
    """The numbers of a case; `seed` of its blade."""

    interfaces: tuple[DrawnInterface, ...]
    n_blades: int
    engine_order: int
    damping_ratio: float
    harmonics: int
    seed: int


def draw_interface_cases(count: int, seed: int) -> list[InterfaceCase]:
    """The first `count` cases of a seed."""
    return [InterfaceCase(seed, index) for index in range(count)]


def blade(drawn: Drawn) -> ReducedModel:
    """The blade of a case with its interfaces."""
    from rom import ContactInterface, ReducedModel, with_interfaces

    rng = np.random.default_rng(drawn.seed)
    sides = sum(each.nodes * (1 if each.kind == KINDS[2] else 2) for each in drawn.interfaces)
    size = 3 * (MASSES + sides)
    stiffness, mass = np.zeros((size, size)), np.repeat([1.0, NODE_MASS], [3 * MASSES, 3 * sides])
    stiffness[:3, :3] += _spring(rng)
    for place in range(1, MASSES):
        _join(stiffness, place - 1, place, _spring(rng))
    node, interfaces = MASSES, []
    for each in drawn.interfaces:
        faces: list[Array] = []
        for _ in range(1 if each.kind == KINDS[2] else 2):
            for count in range(each.nodes):
                _join(stiffness, int(rng.integers(1, MASSES)), node + count, NODE_STIFFNESS * _spring(rng))
            turn = np.kron(np.eye(each.nodes), np.linalg.qr(rng.normal(size=(3, 3)))[0])
            faces.append(turn @ np.eye(size)[3 * node : 3 * (node + each.nodes)])
            node += each.nodes
        left = faces[1] if len(faces) > 1 else None
        place = np.zeros((each.nodes, 3))
        interfaces.append(ContactInterface(faces[0], place, left, inside=each.kind == KINDS[1]))
    force = np.zeros(size)
    force[3 * MASSES - 3 : 3 * MASSES] = rng.normal(size=3)
    force /= np.linalg.norm(force)
    none = np.zeros((3, size)), np.zeros((1, 3))
    model = ReducedModel(np.diag(mass), stiffness, *none, force, {"tip": force}, n_blades=drawn.n_blades)
    return with_interfaces(model, *interfaces)


def _spring(rng: np.random.Generator) -> Array:
    """A spring of three directions, N/m."""
    root = rng.normal(size=(3, 3))
    return STIFFNESS * (np.diag([1.0, 0.6, 4.0]) + 0.1 * root @ root.T)


def _join(stiffness: Array, one: int, other: int, spring: Array) -> None:
    """Join two masses by a spring."""
    a, b = slice(3 * one, 3 * one + 3), slice(3 * other, 3 * other + 3)
    stiffness[a, a] += spring
    stiffness[b, b] += spring
    stiffness[a, b] -= spring
    stiffness[b, a] -= spring

"""Coordinate systems of Nastran: CORD1R, CORD1C, CORD1S by nodes and CORD2R, CORD2C, CORD2S by points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.mesh_files.nastran_cards import Card
from geometry.sector import FloatArray, IntArray


@dataclass(frozen=True)
class _System:
    shape: str  # "R", "C" or "S"
    origin: FloatArray
    axes: FloatArray  # columns


class NastranCoordinates:
    """Places of nodes in the basic system.

    Shapes: `labels` (N,), `systems` (N,), `numbers` (N, 3).
    """

    def __init__(self, cards: list[Card], labels: IntArray, systems: IntArray, numbers: FloatArray) -> None:
        self._cards: dict[int, tuple[Card, int]] = {}
        for card in cards:
            for place in (0, 4) if card.name[4] == "1" else (0,):
                if card.text(place):
                    self._cards[card.label(place)] = (card, place)
        self._known: dict[int, _System] = {0: _System("R", np.zeros(3), np.eye(3))}
        self._open: list[int] = []
        self._labels, self._systems, self._numbers = labels, systems, numbers

    def basic(self) -> FloatArray:
        """Positions of all nodes (N, 3)."""
        points = np.empty_like(self._numbers)
        for system in np.unique(self._systems):
            rows = self._systems == system
            points[rows] = self._moved(self._system(int(system), None), self._numbers[rows])
        return points

    def defined(self, number: int) -> bool:
        """Whether there is a system of this number."""
        return number == 0 or number in self._cards

    def _moved(self, system: _System, values: FloatArray) -> FloatArray:
        first, second, third = values.T
        if system.shape == "C":
            angle = np.radians(second)
            values = np.column_stack([first * np.cos(angle), first * np.sin(angle), third])
        elif system.shape == "S":
            polar, angle = np.radians(second), np.radians(third)
            flat = first * np.sin(polar)
            values = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), first * np.cos(polar)])
        return values @ system.axes.T + system.origin

    def _system(self, number: int, asked: Card | None) -> _System:
        if number in self._known:
            return self._known[number]
        card, place = self._cards[number]
        if number in self._open:
            raise card.refuse(f"coordinate system {number} is defined by itself")
        self._open.append(number)
        if card.name[4] == "1":
            points = np.vstack([self._node(card, place + k) for k in (1, 2, 3)])
        else:
            reference = card.label(1, 0)
            if not self.defined(reference):
                raise card.refuse(f"coordinate system {reference} is not defined")
            given = np.array([card.number(k, 0.0) for k in range(2, 11)]).reshape(3, 3)
            points = self._moved(self._system(reference, card), given)
        third = points[1] - points[0]
        second = np.cross(third, points[2] - points[0])
        if not np.linalg.norm(second) > 1e-12 * np.linalg.norm(third) * np.linalg.norm(points[2] - points[0]):
            raise card.refuse(f"the three points of coordinate system {number} are on a line")
        axes = np.column_stack([np.cross(second, third), second, third])
        self._known[number] = _System(card.name[5], points[0], axes / np.linalg.norm(axes, axis=0))
        return self._known[number]

    def _node(self, card: Card, place: int) -> FloatArray:
        rows = np.flatnonzero(self._labels == card.label(place))
        if not len(rows):
            raise card.refuse(f"node {card.text(place)} is not defined")
        row = int(rows[0])
        system = int(self._systems[row])
        if not self.defined(system):
            raise card.refuse(f"coordinate system {system} is not defined")
        return self._moved(self._system(system, card), self._numbers[row : row + 1])

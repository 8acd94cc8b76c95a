"""Cards of Nastran bulk data: small, large and free fields with their continuations."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from geometry.errors import MeshFileError
from geometry.mesh_files.text_files import LARGEST_LABEL, MOST_INCLUDED, included_file, text_lines

SMALL = tuple((8 * k, 8 * k + 8) for k in range(1, 9))
LARGE = tuple((16 * k - 8, 16 * k + 8) for k in range(1, 5))
T = TypeVar("T")
_EXPONENT = re.compile(r"(?<=[\d.])[dD]?([+-]\d+)$")
_INCLUDE = re.compile(r"\s*INCLUDE\s*[=]?\s*['\"]?([^'\"]+?)['\"]?\s*$", re.IGNORECASE)


@dataclass
class NastranDeck:
    """What a deck holds, split into its sections.

    Attributes
    ----------
    path : str
        The file.
    case_control : list of str
        Lines before BEGIN BULK, without comments.
    bulk : list of (int, str)
        Line number and text of the bulk data, without comments.
    comments : list of str
        Comment lines of programs that name sets there.
    """

    path: str
    case_control: list[str] = field(default_factory=list)
    bulk: list[tuple[int, str]] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Card:
    """A card with all its fields, blank ones as "".

    Attributes
    ----------
    path : str
        The file.
    line : int
        Line of its start, from 1.
    name : str
        In upper case, without the star of large fields.
    fields : list of str
        Data fields; a line of small fields has 8, one of large fields 4.
    """

    path: str
    line: int
    name: str
    fields: list[str]

    def refuse(self, found: str) -> MeshFileError:
        """An error that names file, line and card.

        Parameters
        ----------
        found : str
            What is wrong and what is allowed.
        """
        return MeshFileError(self.path, f"line {self.line}, {self.name}: {found}")

    def text(self, place: int) -> str:
        """A field, "" where there is none.

        Parameters
        ----------
        place : int
            From 0.
        """
        return self.fields[place] if place < len(self.fields) else ""

    def label(self, place: int, default: int | None = None) -> int:
        """A field as an integer that is not negative.

        Parameters
        ----------
        place : int
            From 0.
        default : int, optional
            For a blank field.
        """
        return self._as(place, default, int, "a positive integer", lambda value: 0 <= value <= LARGEST_LABEL)

    def number(self, place: int, default: float | None = None) -> float:
        """A field as a real number.

        Parameters
        ----------
        place : int
            From 0.
        default : float, optional
            For a blank field.
        """
        return self._as(place, default, real, "a number", lambda value: True)

    def _as(
        self, place: int, default: T | None, convert: Callable[[str], T], kind: str, fits: Callable[[T], bool]
    ) -> T:
        text = self.text(place)
        if not text and default is not None:
            return default
        try:
            value = convert(text)
        except ValueError:
            raise self.refuse(f"field {place + 2} is {text!r}: must be {kind}") from None
        if not fits(value):
            raise self.refuse(f"field {place + 2} is {text!r}: must be {kind}")
        return value


def real(text: str) -> float:
    """A real number of Nastran, where the E of the exponent may be missing: 7.5-3.

    Parameters
    ----------
    text : str
        The field.
    """
    try:
        return float(text)
    except ValueError:
        return float(_EXPONENT.sub(r"e\1", text))


def nastran_deck(path: str | Path) -> NastranDeck:
    """The sections of a deck and of the files that it includes.

    Parameters
    ----------
    path : str or path
        The file.

    Raises
    ------
    MeshFileError
        A file cannot be read or must not be included.
    """
    deck = NastranDeck(str(path))
    lines = list(_lines(str(path), str(path), (os.path.realpath(path),), [0]))
    heads = [k for k, (_, line) in enumerate(lines) if line.lstrip()[:5].upper() == "BEGIN"]
    start = heads[0] + 1 if heads else 0
    deck.comments = [line for _, line in lines if line.startswith("$")]
    deck.case_control = [line for _, line in lines[:start] if not line.startswith("$")]
    for number, line in lines[start:]:
        if line[:7].upper() == "ENDDATA":
            break
        if not line.startswith("$"):
            deck.bulk.append((number, line))
    return deck


def _lines(main: str, path: str, chain: tuple[str, ...], opened: list[int]) -> Iterator[tuple[int, str]]:
    opened[0] += 1
    if opened[0] > MOST_INCLUDED or len(chain) > 50:
        raise MeshFileError(main, f"includes more than {MOST_INCLUDED} files or 50 one within the other: too many")
    for number, line in enumerate(text_lines(path), 1):
        if line.startswith("$"):
            if line.startswith("$HMSET"):
                yield number, line
            continue
        if "$" in line:
            line = line.partition("$")[0]
        if not line.strip():
            continue
        name = _included(line)
        if name is None:
            yield number, line
            continue
        target = included_file(main, path, name, chain)
        yield from _lines(main, target, (*chain, target), opened)


def included_names(lines: list[str]) -> list[str]:
    """Files that the `INCLUDE`s of a deck name, as written.

    Parameters
    ----------
    lines : list of str
        Lines of the file.
    """
    found = [_included(line.partition("$")[0]) for line in lines if "INCLUDE" in line.upper()]
    return [name for name in found if name is not None]


def _included(line: str) -> str | None:
    """The file that a line without its comment includes; None for any other line."""
    found = _INCLUDE.match(line) if line.lstrip()[:7].upper() == "INCLUDE" else None
    return None if found is None else found[1].strip()


def cards(deck: NastranDeck) -> Iterator[Card]:
    """The cards of the bulk data.

    Parameters
    ----------
    deck : NastranDeck
        The deck.
    """
    start, name, fields = 0, "", list[str]()
    for number, line in deck.bulk:
        head, own = _split(line)
        if head[:1] in ("", "+", "*"):
            fields += own
            continue
        if name:
            yield Card(deck.path, start, name, fields)
        start, name, fields = number, head.rstrip("*").upper(), own
    if name:
        yield Card(deck.path, start, name, fields)


def _split(line: str) -> tuple[str, list[str]]:
    """First field and data fields of a line."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        count = 4 if "*" in parts[0] else 8
        data = parts[1 : count + 1]
        return parts[0], data + [""] * (count - len(data))
    if "\t" in line:
        line = line.expandtabs(8)
    head = line[:8].strip()
    places = LARGE if "*" in head else SMALL
    return head, [line[first:last].strip() for first, last in places]

"""Cards of Nastran bulk data: small, large and free fields with their continuations."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from geometry.errors import MeshFileError
from geometry.mesh_files.text_files import LARGEST_LABEL, MOST_INCLUDED, included_file, text_lines

SMALL = tuple((8 * k, 8 * k + 8) for k in range(1, 9))
LARGE = tuple((16 * k - 8, 16 * k + 8) for k in range(1, 5))
T = TypeVar("T")
Line = tuple[str, int, str]  # file, number of the line, text
_EXPONENT = re.compile(r"(?<=[\d.])[dD]?([+-]\d+)$")
_INCLUDE = re.compile(r"\s*INCLUDE\s*=?\s*(['\"]?)([^'\"]+)\1\s*$", re.IGNORECASE)
_OPEN = re.compile(r"\s*INCLUDE\s*=?\s*(['\"])[^'\"]*$", re.IGNORECASE)
_MOST_LINES = 20  # of an INCLUDE
_REPEAT = re.compile(r"=\(?(\d{1,7})\)?$")
_STEP = re.compile(r"\*\(?([^()*]+)\)?$")
MOST_REPEATED = 10_000_000


@dataclass
class NastranDeck:
    """What a deck holds, split into its sections."""

    path: str  # the file
    case_control: list[str] = field(default_factory=list)  # lines before BEGIN BULK, without comments
    bulk: list[Line] = field(default_factory=list)  # file, line number and text of the bulk data, without comments
    comments: list[str] = field(default_factory=list)  # comment lines of programs that name sets there


@dataclass(frozen=True)
class Card:
    """A card with all its fields, blank ones as ""."""

    path: str  # the file
    line: int  # line of its start, from 1
    name: str  # in upper case, without the star of large fields
    fields: list[str]  # data fields; a line of small fields has 8, one of large fields 4

    def refuse(self, found: str) -> MeshFileError:
        """An error that names file, line and card."""
        return MeshFileError(self.path, f"line {self.line}, {self.name}: {found}")

    def text(self, place: int) -> str:
        """A field, "" where there is none."""
        return self.fields[place] if place < len(self.fields) else ""

    def label(self, place: int, default: int | None = None) -> int:
        """A field as an integer that is not negative."""
        return self._as(place, default, int, "a positive integer", lambda value: 0 <= value <= LARGEST_LABEL)

    def number(self, place: int, default: float | None = None) -> float:
        """A field as a real number."""
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
    """A real number of Nastran, where the E of the exponent may be missing: 7.5-3."""
    try:
        return float(text)
    except ValueError:
        return float(_EXPONENT.sub(r"e\1", text))


def nastran_deck(path: str | Path) -> NastranDeck:
    """The sections of a deck and of the files that it includes."""
    deck = NastranDeck(str(path))
    lines = list(_lines(str(path), str(path), (os.path.realpath(path),), [0]))
    heads = [k for k, (_, _, line) in enumerate(lines) if line.lstrip()[:5].upper() == "BEGIN"]
    start = heads[0] + 1 if heads else 0
    deck.comments = [line for _, _, line in lines if line.startswith("$")]
    deck.case_control = [line for _, _, line in lines[:start] if not line.startswith("$")]
    for file, number, line in lines[max(start - 1, 0) :]:
        words = line.upper().replace("=", " ").split()
        if words[0] == "ENDDATA":
            break
        if words[0] == "BEGIN":
            if words not in (["BEGIN"], ["BEGIN", "BULK"]):
                raise MeshFileError(
                    file,
                    f"line {number}, {' '.join(line.split())[:40]}: superelements, modules and auxiliary models are "
                    "not read: must be a deck with one BEGIN BULK, such as that of the blade alone",
                )
        elif not line.startswith("$"):
            deck.bulk.append((file, number, line))
    return deck


def _lines(main: str, path: str, chain: tuple[str, ...], opened: list[int]) -> Iterator[Line]:
    opened[0] += 1
    if opened[0] > MOST_INCLUDED or len(chain) > 50:
        raise MeshFileError(main, f"includes more than {MOST_INCLUDED} files or 50 one within the other: too many")
    for number, line, name in _statements(text_lines(path)):
        if name is None:
            if line.lstrip()[:7].upper() == "INCLUDE":
                raise MeshFileError(path, f"line {number}: {line.strip()[:40]!r} must name a file, quotes closed")
            yield path, number, line
            continue
        target = included_file(main, path, name, chain)
        yield from _lines(main, target, (*chain, target), opened)


def _statements(lines: list[str]) -> Iterator[tuple[int, str, str | None]]:
    """Lines with something in them: number, text, and the file that the line includes, if it is an INCLUDE.

    Of comments those with names of sets or with units are kept. A quoted name may go on over lines.
    """
    after = 0
    for number, line in enumerate(lines, 1):
        if number <= after:
            continue
        if line.startswith(("$", "//", "#")):
            if line.startswith(("$HMSET", "$HMNAME", "$*")):
                yield number, line, None
            continue
        text = line.partition("$")[0] if "$" in line else line
        if not text.strip():
            continue
        if text.lstrip()[:7].upper() != "INCLUDE":
            yield number, text, None
            continue
        if _OPEN.match(text):
            quote = _OPEN.match(text)[1]  # type: ignore[index]
            end = next((k for k in range(number, min(number + _MOST_LINES, len(lines))) if quote in lines[k]), None)
            if end is not None:
                text, after = text.strip() + "".join(part.strip() for part in lines[number : end + 1]), end + 1
        found = _INCLUDE.match(text)
        yield number, text, None if found is None else found[2].strip()


def nastran_includes(lines: list[str]) -> list[str]:
    """Files that the `INCLUDE`s of a deck name, as written."""
    return [name for _, _, name in _statements(lines) if name is not None]


def cards(deck: NastranDeck, read: frozenset[str]) -> Iterator[Card]:
    """The cards of the bulk data, replicated ones written out."""
    current: Card | None = None
    before: Card | None = None  # the card written out last, from which replicated ones are made
    pattern: Card | None = None  # the last replicated card as it is written
    mark = ""
    for path, number, line in deck.bulk:
        head, own, marks, surplus = _split(line, current is not None and current.name == "=")
        if head[:1] in ("", "+", "*"):
            if current is None:
                raise MeshFileError(path, f"line {number}: goes on with a card that has not begun: a name is needed")
            if current.name in read and mark.strip("+*") and head.strip("+*") not in ("", mark.strip("+*")):
                raise current.refuse(f"ends with {mark} and goes on with {head}: must go on in the next line")
            current.fields.extend(own)
        else:
            for card in _written_out(current, before, pattern):
                before = card
                yield card
            if current is not None:
                pattern = current if current.name == "=" else pattern if current.name[:1] == "=" else None
            _check_mark(current, mark, read)
            name = "=" if head == "=" else head if head[0] == "=" else head.replace("*", " ").strip().upper()
            current = Card(path, number, name, own)
        mark = marks
        known = before.name if current.name[:1] == "=" and before is not None else current.name
        if surplus and known in read:
            raise current.refuse("has more than 8 data fields in a line: must go on in a line that starts with +")
    yield from _written_out(current, before, pattern)
    _check_mark(current, mark, read)


def _check_mark(card: Card | None, mark: str, read: frozenset[str]) -> None:
    """A number in the last field of a free line, where the name of the next line stands, is a number too many."""
    if card is not None and card.name in read and mark.isdecimal() and mark == mark.strip():
        raise card.refuse(f"has {mark} in field 10, where + stands: must go on in a line that starts with +")


def _written_out(card: Card | None, before: Card | None, pattern: Card | None) -> Iterator[Card]:
    """The card, or those that its replication makes of the card before."""
    if card is None:
        return
    if card.name[:1] != "=":
        yield card
        return
    if before is None:
        raise card.refuse("replicates a card, and there is none before")
    if card.name == "=":
        yield _replicated(card, before)
        return
    count = _REPEAT.match(card.name)
    if count is None or pattern is None or any(card.fields):
        raise card.refuse("must be = with increments such as *(1), or after such a line =(n)")
    if int(count[1]) > MOST_REPEATED:
        raise card.refuse(f"makes {count[1]} cards: must be {MOST_REPEATED} at most")
    for _ in range(int(count[1])):
        before = _replicated(replace(pattern, line=card.line), before)
        yield before


def _replicated(pattern: Card, before: Card) -> Card:
    """A card from the one before: = takes a field over, == all that follow, *(x) adds x."""
    fields: list[str] = []
    rest = False
    for place, text in enumerate(pattern.fields):
        if place % 8 == 0:
            rest = rest and place >= len(before.fields)
        rest = rest or text == "=="
        fields.append(before.text(place) if rest or text == "=" else _stepped(pattern, text, before.text(place)))
    if rest:
        fields += before.fields[len(fields) :]
    return Card(pattern.path, pattern.line, before.name, fields)


def _stepped(card: Card, text: str, before: str) -> str:
    if text[:1] != "*":
        return text
    step = _STEP.match(text)
    try:
        if step is None:
            raise ValueError
        try:
            return str(int(before) + int(step[1]))
        except ValueError:
            return repr(real(before) + real(step[1]))
    except ValueError:
        raise card.refuse(f"{text!r} after {before!r}: must be an increment such as *(1) of a number") from None


def card_of(path: str, line: str) -> Card:
    """A line of the case control section as a card, which PARAM may be there too."""
    head, fields, *_ = _split(line, False)
    return Card(path, 0, head.replace("*", " ").strip().upper(), fields)


def _split(line: str, replicates: bool) -> tuple[str, list[str], str, bool]:
    """First field, data fields, last field of a line, and whether it has more; of fixed fields no last one counts.

    In a card that replicates, *(1) in the first field steps the name of the line.
    """
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        head = "+" if replicates and _STEP.match(parts[0]) else parts[0]
        count = 4 if "*" in head else 8
        data = parts[1 : count + 1]
        last = parts[count + 1] if len(parts) > count + 1 else ""
        return head, data + [""] * (count - len(data)), last, any(parts[count + 2 :])
    if "\t" in line:
        line = line.expandtabs(8)
    head = line[:8].strip()
    if replicates and _STEP.match(head):
        head = "+"
    places = LARGE if "*" in head else SMALL
    mark = line[72:80].strip()
    return head, [line[first:last].strip() for first, last in places], mark if mark[:1] in ("+", "*") else "", False

"""Latin hypercube of a sweep: n points of which each n-th of every range holds exactly one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pipeline.errors import input_error, shown
from pipeline.scene.schema import SECTIONS
from pipeline.scene.swept_keys import flattened
from pipeline.scene.validation_errors import shown_key, unknown_key

PLACE = "sweep.latin_hypercube"
KEYS = ("samples", "seed", "ranges", "logarithmic")
LARGEST_SEED = 2**63 - 1  # of TOML's whole numbers
_RANGE = "[low, high], two numbers, low below high"


def sampled_columns(path: Path, table: Any, most: int) -> dict[str, list[float]]:
    """The points of a Latin hypercube, a list for each key."""
    if not isinstance(table, Mapping):
        raise input_error(path, PLACE, shown(table), f"a table [{PLACE}] with {', '.join(KEYS)}")
    for key in table:
        if key not in KEYS:
            raise unknown_key(path, key, KEYS, PLACE)
    samples = _whole(path, table, "samples", (1, most), f"a whole number of points, 1 to {most}")
    allowed = "a whole number, 0 or more: the same seed gives the same points"
    seed = _whole(path, table, "seed", (0, LARGEST_SEED), allowed)
    ranges = _ranges(path, table.get("ranges"))
    logarithmic = _logarithmic(path, table.get("logarithmic", []), ranges)
    return _sample(samples, seed, ranges, logarithmic)


def _whole(path: Path, table: Mapping[str, Any], name: str, bounds: tuple[int, int], allowed: str) -> int:
    value = table.get(name)
    found = "missing" if name not in table else shown(value)
    if not isinstance(value, int) or isinstance(value, bool) or not bounds[0] <= value <= bounds[1]:
        raise input_error(path, f"{PLACE}.{name}", found, allowed)
    return value


def _ranges(path: Path, table: Any) -> dict[str, tuple[float, float]]:
    """Lowest and highest value of each key."""
    place = f"{PLACE}.ranges"
    if not isinstance(table, Mapping) or not table:
        found = "missing" if table is None else shown(table)
        raise input_error(path, place, found, "a table of dotted keys with [low, high]")
    ranges = {}
    for key, bounds in flattened(path, table, place):
        if not takes_fractions(key):
            allowed = "keys of numbers with a fraction; others as lists or points"
            raise input_error(path, f"{place}.{shown_key(key)}", "cannot have a range", allowed)
        if not _is_range(bounds):
            raise input_error(path, f"{place}.{shown_key(key)}", shown(bounds), _RANGE)
        ranges[key] = (float(bounds[0]), float(bounds[1]))
    return ranges


def _is_range(bounds: Any) -> bool:
    if not isinstance(bounds, list) or len(bounds) != 2:
        return False
    numbers = all(isinstance(b, int | float) and not isinstance(b, bool) and abs(b) < 1e100 for b in bounds)
    return numbers and bounds[0] < bounds[1]


def _logarithmic(path: Path, keys: Any, ranges: Mapping[str, tuple[float, float]]) -> frozenset[str]:
    """Keys whose logarithm is sampled."""
    allowed = "a list of keys of ranges above 0"
    if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys):
        raise input_error(path, f"{PLACE}.logarithmic", shown(keys), allowed)
    for key in keys:
        if key not in ranges or ranges[key][0] <= 0.0:
            found = f"{shown(key)} has {f'the range {list(ranges[key])}' if key in ranges else 'no range'}"
            raise input_error(path, f"{PLACE}.logarithmic", found, allowed)
    return frozenset(keys)


def _sample(
    samples: int, seed: int, ranges: Mapping[str, tuple[float, float]], logarithmic: frozenset[str]
) -> dict[str, list[float]]:
    import numpy as np
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed)).random(samples)
    columns = {}
    for number, (key, (low, high)) in enumerate(ranges.items()):
        a, b = (math.log(low), math.log(high)) if key in logarithmic else (low, high)
        values = a + (b - a) * unit[:, number]
        columns[key] = np.clip(np.exp(values) if key in logarithmic else values, low, high).tolist()
    return columns


def takes_fractions(key: str) -> bool:
    """Whether a key may be any number of a range."""
    section, _, name = key.partition(".")
    return _holds_float(SECTIONS[section].model_fields[name].annotation)


def _holds_float(annotation: Any) -> bool:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _holds_float(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return any(_holds_float(item) for item in get_args(annotation))
    return annotation is float

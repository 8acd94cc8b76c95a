"""Checks of [uncertainty] beyond the schema: what the distributions need of the rest of the scene."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.schema import Scene
from pipeline.scene.sweep import key_value
from pipeline.scene.validation_errors import allowed_values
from pipeline.studies.uncertainty.section import Marginal, UncertainParameter, bounds_of, marginal_of

LEAST_MASS = 0.01  # of a distribution that low and high leave
MOST_OUTSIDE = 1e-3  # of a distribution that the range of the key cuts off without being asked to


def unfit_uncertainty_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [uncertainty] that do not fit the rest of a scene."""
    scene = file.first
    if scene.uncertainty is None:
        return
    if not scene.uncertainty.parameter:
        yield input_error(file.path, "uncertainty.parameter", "missing", allowed_values("uncertainty.parameter"))
    for number, item in enumerate(scene.uncertainty.parameter):
        yield from _unfit_parameter(file.path, scene, item, f"uncertainty.parameter[{number}]")
    if scene.uncertainty.correlation and (other := _independent_only(scene)):
        yield input_error(file.path, "uncertainty.correlation", f"beside {other}", "independent parameters there")


def _independent_only(scene: Scene) -> str:
    """A key of the scene that takes uncertain parameters for independent; "": there is none."""
    asked = {
        "uncertainty.sensitivities": scene.uncertainty is not None and scene.uncertainty.sensitivities,
        'optimum.tolerance = "uncertainty"': scene.optimum is not None and scene.optimum.tolerance == "uncertainty",
        "crossings.limit or margin": scene.crossings is not None
        and (scene.crossings.limit is not None or scene.crossings.margin is not None),
        "wear.samples": scene.wear is not None and scene.wear.samples is not None,
    }
    return next((key for key, is_asked in asked.items() if is_asked), "")


def _unfit_parameter(path: Path, scene: Scene, item: UncertainParameter, place: str) -> Iterator[InputError]:
    nominal = key_value(scene, item.key)
    if item.key == "response.damping_ratio" and nominal is None:
        yield input_error(path, f"{place}.key", "damping is given by rayleigh", "response.damping_ratio in the scene")
        return
    table = item.key.partition(".")[0]
    if table in ("damper", "material") and nominal is None:
        yield input_error(path, f"{place}.key", f"the scene has no [{table}]", "keys of sections that it has")
        return
    centre = "median" if item.distribution == "lognormal" else "mean"
    given = item.distribution == "uniform" or getattr(item, centre) is not None
    if nominal is None and not given:
        yield input_error(path, f"{place}.{centre}", "missing", f'a number, as {item.key} is "punch"')
        return
    yield from _unfit_distribution(path, item, marginal_of(item, nominal or 0.0), place, centre)


def _unfit_distribution(
    path: Path, item: UncertainParameter, marginal: Marginal, place: str, centre: str
) -> Iterator[InputError]:
    least, most = bounds_of(item.key)
    for name, value in (("low", item.low), ("high", item.high), (centre, getattr(item, centre))):
        if value is not None and not least <= value <= most:
            yield input_error(path, f"{place}.{name}", shown(value), f"{least:g} to {most:g}, as {item.key}")
            return
    if item.distribution == "uniform":
        return
    if marginal.spread == 0.0 or (item.distribution == "lognormal" and marginal.centre <= 0.0):
        found = f"{marginal.centre:g}" + ("" if getattr(item, centre) else f", the value of {item.key}")
        allowed = "a number other than 0 with relative_deviation" if centre == "mean" else "a number above 0"
        yield input_error(path, f"{place}.{centre}", found, allowed)
        return
    if not marginal.low < marginal.high:
        yield input_error(path, f"{place}.high", shown(marginal.high), f"a number above low, {marginal.low:g}")
    elif marginal.mass < LEAST_MASS:
        found = f"{100.0 * marginal.mass:.2g} % of the distribution"
        yield input_error(path, place, f"low and high leave {found}", f"{100.0 * LEAST_MASS:g} % or more")
    elif item.low is None and item.high is None and marginal.mass < 1.0 - MOST_OUTSIDE:
        found = f"{100.0 * (1.0 - marginal.mass):.2g} % of the distribution"
        allowed = f"{100.0 * MOST_OUTSIDE:g} % at most; give low = {least:g}, or a lognormal distribution"
        yield input_error(path, place, f"{found} lies outside {least:g} to {most:g}", allowed)

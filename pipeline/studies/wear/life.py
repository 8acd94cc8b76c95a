"""The life of a scene whose contact faces wear: duty, coefficients and areas on its reduced model."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.process.progress import seconds_since
from pipeline.scene.dotted_keys import CONTACT, INTERFACE
from pipeline.scene.labels import value_label
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.scene_to_solver import nonlinear_problem
from pipeline.studies.study import StudyContext, StudyError
from pipeline.studies.wear.checks import PLACE
from pipeline.studies.wear.result import Numbers

if TYPE_CHECKING:
    from nonlinear.wear.wear_history import WearHistory
    from nonlinear.wear.worn_motion import OperatingPoint
    from pipeline.scene.reading import Member
    from pipeline.studies.wear.section import DutyPoint, Wear
    from rom.cyclic.reduced_model import ReducedModel

HOUR = 3600.0
FEWER = {"steps": 16, "checks": 4}  # steps at least, and checks, of one of many lives
AT = "worn"  # the parameter by which worn scenes differ: a word, so that no branch is carried from one to another


@dataclass
class Life:
    """A life of a scene."""

    context: StudyContext
    section: Wear
    values: Mapping[str, Any] = field(default_factory=dict)  # other values of some keys of the scene
    model: ReducedModel = field(init=False)  # that of the last operating point

    def history(
        self, progress: Callable[[float, float], None] | None = None, one_of_many: bool = False
    ) -> WearHistory:
        """The slow time, from the curves of the duty on; `progress` as of `nonlinear.wear_history`."""
        from nonlinear.wear.wear_history import wear_history
        from nonlinear.wear.worn_motion import MotionLostError
        from rom.linear_algebra.threads import one_blas_thread

        points, section = self._points(), self.section
        limits = {"amplitude": section.amplitude_limit, "depth": section.depth_limit}
        life = {"cycles": section.cycles} if section.hours is None else {"seconds": section.hours * HOUR}
        fewer: dict[str, Any] = FEWER if one_of_many else {}
        try:
            with one_blas_thread():
                return wear_history(
                    points,
                    self.by_node(),
                    self.areas(),
                    limits={name: value for name, value in limits.items() if value is not None},
                    tolerance=section.tolerance,
                    progress=progress,
                    **life,
                    **fewer,
                )
        except MotionLostError as error:
            raise StudyError(str(error)) from None

    def _points(self) -> list[OperatingPoint]:
        """The operating points of the duty with their responses before any wear."""
        from nonlinear.wear.worn_motion import OperatingPoint
        from rom.files.reduced_model_file import read_reduced_model

        members, found = self.members(), []
        for member, curve, point in zip(members, self.context.curves(members), self.section.points, strict=True):
            if curve.file is None or curve.rom is None:
                raise StudyError(curve.reason)
            self.model = read_reduced_model(curve.rom, with_basis=False)
            problem = nonlinear_problem(member.scene, self.model)
            given = {"share": point.share, "frequency_hz": point.frequency, "curve": read_curve(curve.file)}
            found.append(OperatingPoint(problem, **given))  # type: ignore[arg-type]
        return found

    def members(self) -> list[Member]:
        """The scene at each operating point, before any wear."""
        return [self.member(point, {}, point_label(point) or "at the peak") for point in self.section.points]

    def member(self, point: DutyPoint, values: Mapping[str, Any], name: str) -> Member:
        """The scene at an operating point with other values of some keys."""
        return replace(self.context.member({**self.values, **point.values, **values}, PLACE), parameters={AT: name})

    def names(self) -> list[str]:
        """Interface of each contact node."""
        return [name for name, count in self.model.interfaces.items() for _ in range(count)]

    def by_node(self) -> Numbers:
        """Wear coefficient of each node, m^3/J."""
        given = self.section.coefficient
        if not isinstance(given, dict):
            return np.full(self.model.n_contacts, given)
        tables = {name: self.context.scene.table_of(name) for name in self.model.interfaces}
        if unknown := set(given) - {*tables, *tables.values()}:
            names = ", ".join(self.model.interfaces)
            raise StudyError(f"wear.coefficient: no interface {min(unknown)}, allowed: {names}")
        return np.array([given.get(name, given.get(tables[name], 0.0)) for name in self.names()])

    def areas(self) -> Numbers:
        """Area of each node, m^2."""
        if self.model.contact_area is not None:
            return self.model.contact_area
        if self.section.area is None:
            raise StudyError("the reduced model has no areas of its contact nodes, allowed: wear.area")
        return np.array([self.section.area / self.model.interfaces[name] for name in self.names()])

    def worn(self, interference: Numbers) -> dict[str, Any]:
        """Keys of the scene with the interference left; an interface in the table of several gets one of its own."""
        found: dict[str, Any] = {}
        scene, first = self.context.scene, 0
        if len(self.model.interfaces) == 1 and not scene.interface:
            return {f"{CONTACT}.interference": interference.tolist()}
        for name, count in self.model.interfaces.items():
            own = scene.interface.get(scene.table_of(name))
            given: dict[str, Any] = {} if own is None else own.model_dump(exclude_none=True)
            given["interference"] = interference[first : first + count].tolist()
            found |= {f"{INTERFACE}.{name}.{key}": value for key, value in given.items()}
            first += count
        return found


def point_label(point: DutyPoint) -> str:
    """An operating point by what it gives; empty where that is nothing."""
    given = [value_label(key, value) for key, value in point.values.items()]
    return ", ".join([*given, *([] if point.frequency is None else [f"{point.frequency:g} Hz"])])


@dataclass(frozen=True)
class Highest:
    """The highest followed amplitude of a life."""

    amplitude_m: float
    frequency_hz: float
    hours: float  # when
    left: str  # why it may be higher; "" where the life was reached
    seconds: float  # what it took, s


def highest_of_life(context: StudyContext, section: Wear, values: Mapping[str, Any]) -> Highest:
    """The highest followed amplitude of a life of the scene with other values of some keys; found in the store or
    computed."""
    own = context.member(values, PLACE)
    inputs = {"wear": section.model_dump(), "curve": context.key_of(own, context.model_of(own))}

    def compute() -> Highest:
        start = time.perf_counter()
        found = Life(context, section, values).history(one_of_many=True)
        at = int(found.highest_m.argmax())
        point = int(found.amplitude_m[at].argmax())
        place = float(found.frequency_hz[at, point]), float(found.time_s[at] / HOUR)
        left = "" if found.complete else f"the motion was lost after {found.time_s[-1] / HOUR:.4g} h"
        return Highest(float(found.highest_m[at]), *place, left, seconds_since(start))

    return context.stored("life", inputs, Highest, __name__, compute)

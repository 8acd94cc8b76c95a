"""Wear over a life: sliding removes material in proportion to its friction work, and the interference wears off.

The state is the friction work W (n_c,) that each node has done, J, with the time t and the cycles n. With operating
points d, their shares of the time g_d, frequencies f_d and work per cycle and node E_d,

    dW/dt = sum_d g_d f_d E_d(v0),    dn/dt = sum_d g_d f_d,    v0 = v0_0 - alpha W / A,

alpha the volume that a joule wears off both faces together, A the area of a node. The motion is that of the steady
response with the present interference, as wear is slow. The pair of Bogacki and Shampine (orders 3 and 2) chooses the
steps by its error of the interference; between them its cubic holds.

References
----------
S. Fouvry, P. Kapsa, H. Zahouani, L. Vincent, "Wear analysis in fretting of hard coatings through a dissipated energy
concept", Wear 203-204 (1997) 393-403.
L. R. Tamatam, D. Botto, S. Zucca, "A coupled approach to model the effect of wear on the dynamics of the shrouded
bladed disk", arXiv:2102.05594 (2021).
P. Bogacki, L. F. Shampine, "A 3(2) pair of Runge-Kutta formulas", Applied Mathematics Letters 2 (1989) 321-325.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactError
from nonlinear.options import OptionsError
from nonlinear.wear.worn_motion import MotionFollower, MotionLostError, OperatingPoint, RangeLeftError, WornMotion

if TYPE_CHECKING:
    from scipy.integrate import RK23

LOST = 1e-3  # mean normal load over the cycle, relative to the largest before any wear, that is no contact
SMALLEST_STEP = 1e-9  # of the life, below which a motion counts as lost
JUMP = 1e-6  # of the life, beyond the end of a motion, where the response is traced again
SAME = 0.01  # relative difference of amplitudes up to which a traced motion is the lost one
STEPS, CHECKS = 40, 10  # of a life, at least
LOCATED = 1e-6  # relative error of the time of an event
IDLE = 1e-9  # power of friction, relative to its largest, that is none
MOST_JUMPS = 20  # of a life
HIGHER = 1.03  # ratio of another peak to the followed one above which it is followed instead
Kind = Literal["limit", "lowest amplitude", "node separates", "jump", "higher peak", "stick", "separation", "lost"]


@dataclass(frozen=True)
class WearEvent:
    """Something that happens in a life.

    Attributes
    ----------
    kind : str
        "limit": a limit is reached. "lowest amplitude": the highest motion passes a minimum. "node separates": a node
        loses contact in the whole cycle. "jump": a motion ended, the response was traced again. "higher peak": a peak
        was higher than the followed one and is followed from there on. "stick": no node slips any more, wear ends.
        "separation": no node is in contact any more. "lost": the motion was not found again, the history ends.
    time_s, cycles : float
        When, s and cycles.
    said : str
        What, in a few words: the limit, the node, the operating point.

    Examples
    --------
    >>> from nonlinear import WearEvent
    >>> WearEvent("limit", time_s=3600.0, cycles=1e6, said="depth").kind
    'limit'
    """

    kind: Kind
    time_s: float
    cycles: float
    said: str = ""


@dataclass(frozen=True)
class WearHistory:
    """Wear over a life, at T times.

    Attributes
    ----------
    time_s, cycles : (T,) float
        Time, s, and cycles since the start.
    work_j : (T, n_c) float
        Friction work done by each node, J.
    volume_m3 : (T, n_c) float
        Worn volume of each node, of both faces together, m^3.
    depth_m : (T, n_c) float
        Worn depth of both faces together: what the interference has lost, m.
    interference_m : (T, n_c) float
        Interference left, m.
    amplitude_m, frequency_hz : (T, D) float
        Amplitude of the output and frequency of each of D operating points, m and Hz.
    load_n : (T, D) float
        Mean normal load of the whole contact over the cycle, N.
    power_w : (T,) float
        Mean power of friction over the duty, W.
    sticking, slipping, separating : (T, D) int
        Number of nodes in each worst state, as in a response curve.
    events : tuple of WearEvent
        What happened, in order.
    error_m : float
        Largest sum of the error estimates of a node's interference over all steps, m.
    evaluations, traces : int
        Number of times that motions were solved for, and that responses were traced.
    complete : bool
        Whether the life was reached.

    Examples
    --------
    With the names of the example of `wear_history`:

    >>> history.complete, bool(history.depth_m[-1] > 0.0)
    (True, True)
    """

    time_s: Array
    cycles: Array
    work_j: Array
    volume_m3: Array
    depth_m: Array
    interference_m: Array
    amplitude_m: Array
    frequency_hz: Array
    load_n: Array
    power_w: Array
    sticking: NDArray[np.int64]
    slipping: NDArray[np.int64]
    separating: NDArray[np.int64]
    events: tuple[WearEvent, ...]
    error_m: float
    evaluations: int
    traces: int
    complete: bool

    @property
    def highest_m(self) -> Array:
        """The highest amplitude over all operating points, (T,), m."""
        return np.asarray(self.amplitude_m.max(axis=1))

    def interference_at(self, time_s: float) -> Array:
        """Interference of each node at a time: that of a restart, (n_c,), m.

        Parameters
        ----------
        time_s : float
            Time, s; between the stored times it is interpolated linearly.
        """
        return np.array([np.interp(time_s, self.time_s, column) for column in self.interference_m.T])


@dataclass(frozen=True)
class _State:
    """One state of the slow time with the motions."""

    place: float  # slow variable: s or cycles
    other: float  # the other one
    work: Array  # (n_c,), J
    motions: tuple[WornMotion, ...]


Condition = tuple[Kind, str, Callable[[_State], bool]]  # kind of an event, words, whether it holds in a state


@dataclass
class _Life:
    """A life being integrated."""

    followers: Sequence[MotionFollower]
    shares: Array  # (D,), sum 1
    coefficient: Array  # (n_c,), alpha, m^3/J
    depth_per_joule: Array  # (n_c,), alpha / A, m/J
    over_cycles: bool
    limits: Mapping[str, float]
    motions: tuple[WornMotion, ...] = ()  # last motions solved for, and their worn depth
    depth: Array = field(default_factory=lambda: np.zeros(0))
    evaluations: int = 0
    states: list[_State] = field(default_factory=list)
    events: list[tuple[float, float, Kind, str]] = field(default_factory=list)
    error: Array = field(default_factory=lambda: np.zeros(0))
    jump: tuple[float, float] = (-np.inf, 0.0)  # place of the last jump, and how far beyond the state before it
    jumps: int = 0
    checked: int = 0  # the last state at which no peak was higher than the followed ones

    def start(self) -> _State:
        """The state before any wear."""
        self.depth = 0.0 * self.depth_per_joule
        self.motions = tuple(each.first() for each in self.followers)
        self.error = 0.0 * self.depth
        self.states.append(_State(0.0, 0.0, 0.0 * self.depth, self.motions))
        return self.states[0]

    def at(self, work: Array) -> tuple[WornMotion, ...]:
        """The motions when each node has done a work (n_c,), J."""
        depth = self.depth_per_joule * work
        if not np.array_equal(depth, self.depth):
            moved = [
                follower.followed(motion, self.depth, depth)
                for follower, motion in zip(self.followers, self.motions, strict=True)
            ]
            self.evaluations += len(moved)
            self.motions, self.depth = tuple(moved), depth
        return self.motions

    def rate(self, _: float, state: Array) -> Array:
        """Derivative of (W, other slow variable) over the slow variable."""
        motions = self.at(state[:-1])
        cycles = self.shares * [motion.frequency_hz for motion in motions]
        per_second = cycles @ np.array([motion.work for motion in motions])
        total = float(cycles.sum())
        return np.append(per_second, total) if not self.over_cycles else np.append(per_second, 1.0) / total

    def higher(self, state: _State) -> tuple[WornMotion, ...] | None:
        """The motions with peaks that are higher than the followed ones; None where none is."""
        found = list(state.motions)
        for d, follower in enumerate(self.followers):
            if follower.at.frequency_hz is None and self.shares[d] > 0.0:
                with suppress(MotionLostError):
                    other = follower.traced(self.depth_per_joule * state.work)
                    if other.amplitude > HIGHER * found[d].amplitude:
                        found[d] = other
        return None if all(a is b for a, b in zip(found, state.motions, strict=True)) else tuple(found)

    def power(self, motions: Sequence[WornMotion]) -> float:
        """Mean power of friction, W."""
        pairs = zip(self.shares, motions, strict=True)
        return float(sum(share * motion.frequency_hz * motion.work.sum() for share, motion in pairs))

    def reached(self, place: float, state: Array) -> _State:
        """The state with its motions at (W, other slow variable)."""
        return _State(place, float(state[-1]), state[:-1].copy(), self.at(state[:-1]))

    def load(self, motions: Sequence[WornMotion]) -> Array:
        """Mean normal load of each node at each operating point, (D, n_c), N."""
        pairs = zip(self.followers, motions, strict=True)
        return np.array([motion.load(follower.problem.contact.preload) for follower, motion in pairs])

    def conditions(self, first: _State) -> list[Condition]:
        """What is watched for: kind, words, and whether it holds in a state."""
        limits, lowest = self.limits, LOST * float(self.load(first.motions).max())
        found: list[Condition] = []

        def watch(kind: Kind, said: str, holds: Callable[[_State], bool]) -> None:
            if not holds(first):
                found.append((kind, said, holds))
            elif kind == "limit":
                self.events.append((first.place, first.other, kind, f"{said}, from the start"))

        if "amplitude" in limits:
            watch("limit", "amplitude", lambda at: _highest(at.motions).amplitude >= limits["amplitude"])
        if "depth" in limits:
            watch("limit", "depth", lambda at: float((self.depth_per_joule * at.work).max()) >= limits["depth"])
        for node in range(self.depth.size):
            watch("node separates", f"node {node}", lambda at, k=node: bool(self._open(at, lowest)[k]))  # type: ignore[misc]
        watch("separation", "", lambda at: bool(self._open(at, lowest).all()))
        power = self.power(first.motions)
        if power == 0.0:
            sticks = not self._open(first, lowest).all()
            self.events.append((first.place, first.other, "stick" if sticks else "separation", "from the start"))
        else:
            watch("stick", "", lambda at: self._idle(at, power) and not self._open(at, lowest).all())
        return found

    def _open(self, at: _State, lowest: float) -> NDArray[np.bool_]:
        """Whether each node is in contact at no operating point, (n_c,)."""
        return np.asarray((self.load(at.motions) <= lowest).all(axis=0))

    def _idle(self, at: _State, power: float) -> bool:
        return self.power(at.motions) <= IDLE * power


def wear_history(
    points: Sequence[OperatingPoint],
    coefficient: ArrayLike,
    area: ArrayLike,
    *,
    seconds: float | None = None,
    cycles: float | None = None,
    limits: Mapping[str, float] | None = None,
    tolerance: float = 1e-3,
    steps: int = STEPS,
    checks: int = CHECKS,
    progress: Callable[[float, float], None] | None = None,
) -> WearHistory:
    """Wear of the contact faces over a life.

    Parameters
    ----------
    points : sequence of OperatingPoint
        The duty. All have the same contact nodes with the same interference.
    coefficient : float or (n_c,) float
        Wear coefficient alpha: volume worn off both faces together per friction work, m^3/J.
    area : float or (n_c,) float
        Area of each node, m^2.
    seconds, cycles : float
        The life: one of the two, s or cycles over all operating points.
    limits : mapping of str to float, optional
        "amplitude", "depth": limits whose time is wanted, m. The history goes on beyond them.
    tolerance : float
        Largest error of the interference in a step, relative to the interference or, where that is larger, to the
        normal vibration of the contact before any wear.
    steps : int
        Least number of steps.
    checks : int
        Number of times at which the response is traced to see whether a peak is higher than the followed one.
    progress : callable, optional
        Called with the share of the life and the highest amplitude (m) after each step.

    Returns
    -------
    WearHistory
        The life.

    Raises
    ------
    OptionsError
        A number is out of its range, or the duty sums to nothing.
    MotionLostError
        There is no motion to begin with.

    Examples
    --------
    With the names of the example of `forced_response`, where no load wears off as it is a preload:

    >>> from nonlinear import OperatingPoint, wear_history
    >>> point = OperatingPoint((modal, contact, excitation, options), curve=curve)
    >>> history = wear_history([point], coefficient=1e-13, area=1e-4, cycles=1e6)
    >>> bool(np.isclose(history.work_j[-1, 0], 1e6 * curve.dissipated_j.max(), rtol=1e-6))
    True
    """
    life = _life(points, coefficient, area, (seconds, cycles), dict(limits or {}), tolerance)
    span, first = float(seconds or cycles or 0.0), life.start()
    conditions = life.conditions(first)
    lengths = tolerance * _scale(life, first), span / max(steps, 1), span / checks if checks > 0 else np.inf
    on = True
    while on:
        try:
            on = _integrate(life, span, lengths, conditions, progress)
        except MotionLostError as lost:
            on = _traced_again(life, span, lost)
    return _history(life, span)


def _life(
    points: Sequence[OperatingPoint],
    coefficient: ArrayLike,
    area: ArrayLike,
    span: tuple[float | None, float | None],
    limits: dict[str, float],
    tolerance: float,
) -> _Life:
    """The life, with its input checked."""
    if not points:
        raise OptionsError("points: none, allowed: one operating point or more")
    contact = points[0].problem.contact
    for each in points[1:]:
        if not np.array_equal(each.problem.contact.interference, contact.interference):
            raise ContactError("interference: differs between operating points, allowed: the same at all")
    values = {}
    for name, value in (("coefficient", coefficient), ("area", area)):
        values[name] = np.broadcast_to(np.asarray(value, dtype=float), contact.n_contacts).copy()
        good = np.isfinite(values[name]) & (values[name] >= 0.0 if name == "coefficient" else values[name] > 0.0)
        if not good.all():
            allowed = "0 or more, m^3/J" if name == "coefficient" else "above 0, m^2"
            raise OptionsError(f"{name}: {float(values[name][~good][0])!r}, allowed: {allowed}")
    given = [each for each in span if each is not None]
    if len(given) != 1 or not 0.0 < given[0] < float("inf"):
        raise OptionsError(f"seconds, cycles: {span[0]}, {span[1]}, allowed: one of the two, above 0")
    if not 0.0 < tolerance < 1.0:
        raise OptionsError(f"tolerance: {tolerance!r}, allowed: between 0 and 1")
    if unknown := set(limits) - {"amplitude", "depth"}:
        raise OptionsError(f'limits: {min(unknown)!r}, allowed: "amplitude" and "depth"')
    shares = np.array([each.share for each in points])
    if not shares.sum() > 0.0:
        raise OptionsError("share: the duty sums to 0, allowed: a share above 0")
    followers = [MotionFollower(each) for each in points]
    alpha = values["coefficient"]
    return _Life(followers, shares / shares.sum(), alpha, alpha / values["area"], span[0] is None, limits)


def _scale(life: _Life, first: _State) -> float:
    """Interference, or normal vibration of the contact where that is larger, m."""
    contact = life.followers[0].problem.contact
    normal = max(float(np.abs(motion.point.displacement[1:, :, 2]).max()) for motion in first.motions)
    return max(float(np.abs(contact.interference).max()), normal)


def _integrate(
    life: _Life,
    span: float,
    lengths: tuple[float, float, float],
    conditions: Sequence[Condition],
    progress: Callable[[float, float], None] | None,
) -> bool:
    """Steps from the last state to the end of the life; True where another peak is to be followed before.

    `lengths`: error of the interference in a step, m; longest step; distance of two checks.
    """
    from scipy.integrate import RK23

    error, longest, apart = lengths
    last, begun = life.states[-1], len(life.states)
    if last.place >= span:
        return False
    told = {event[2:] for event in life.events}
    conditions = [each for each in conditions if each[:2] not in told]
    with np.errstate(divide="ignore"):
        allowed = np.where(life.depth_per_joule > 0.0, error / life.depth_per_joule, np.finfo(float).max)
    scales = {"rtol": 1e-12, "atol": np.append(allowed, np.inf)}
    first = min(longest, span - last.place)
    state = np.append(last.work, last.other)
    solver = RK23(life.rate, last.place, state, span, max_step=longest, first_step=first, **scales)
    while solver.status == "running":
        before = life.states[-1]
        _step(life, solver, span)
        dense = solver.dense_output()
        after = life.reached(solver.t, solver.y)
        life.error += np.abs(life.depth_per_joule * _step_error(solver)[:-1])
        for condition in [each for each in conditions if each[2](after)]:
            _locate(life, condition, dense, before, after)
            conditions.remove(condition)
        life.states.append(after)
        if len(life.states) - begun >= 2:
            _lowest(life, life.states[-3:])
        if after.place - life.states[life.checked].place >= apart and _overtaken(life):
            return True
        if progress is not None:
            progress(solver.t / span, _highest(after.motions).amplitude)
    return False


def _overtaken(life: _Life) -> bool:
    """Whether another peak has become higher: the states end where that began, with the higher peak."""
    low, high = life.checked, len(life.states) - 1
    found = life.higher(life.states[high])
    if found is None:
        life.checked = high
        return False
    while high - low > 1:
        middle = (low + high) // 2
        earlier = life.higher(life.states[middle])
        low, high, found = (middle, high, found) if earlier is None else (low, middle, earlier)
    at = life.states[high]
    life.states[high + 1 :] = [replace(at, motions=found)]
    life.events = [event for event in life.events if event[0] <= at.place]
    life.events.append((at.place, at.other, "higher peak", f"at {_highest(found).frequency_hz:.5g} Hz"))
    life.motions, life.depth, life.checked = found, life.depth_per_joule * at.work, high + 1
    return True


def _highest(motions: Sequence[WornMotion]) -> WornMotion:
    return max(motions, key=lambda motion: motion.amplitude)


def _step(life: _Life, solver: RK23, span: float) -> None:
    """One step; a shorter one where a motion is lost on the way."""
    motions, depth = life.motions, life.depth
    while True:
        try:
            solver.step()
        except MotionLostError:
            life.motions, life.depth = motions, depth
            solver.h_abs = 0.25 * min(solver.h_abs, solver.max_step, span - solver.t)
            if solver.h_abs < SMALLEST_STEP * span:
                raise
        else:
            return


def _step_error(solver: RK23) -> Array:
    """The error estimate of the last step: the difference of the two formulas."""
    return np.asarray((solver.t - solver.t_old) * (solver.K.T @ solver.E))


def _locate(
    life: _Life,
    condition: Condition,
    dense: Callable[[float], Array],
    before: _State,
    after: _State,
) -> None:
    """Note when in a step a condition begins to hold, by bisection."""
    kind, said, holds = condition
    low, high, found = before.place, after.place, after
    while high - low > LOCATED * high:
        middle = 0.5 * (low + high)
        here = life.reached(middle, dense(middle))
        if holds(here):
            high, found = middle, here
        else:
            low = middle
    life.events.append((found.place, found.other, kind, said))
    life.at(after.work)


def _lowest(life: _Life, states: Sequence[_State]) -> None:
    """Note a minimum of the highest amplitude among three states: that of the parabola through them."""
    place = np.array([each.place for each in states])
    value = np.array([_highest(each.motions).amplitude for each in states])
    if not (value[0] > value[1] < value[2] and place[0] < place[1] < place[2]):
        return
    low = float(-0.5 * np.polyfit(place - place[1], value, 2)[1] / np.polyfit(place - place[1], value, 2)[0])
    at = place[1] + low
    other = float(np.interp(at, place, [each.other for each in states]))
    life.events.append((at, other, "lowest amplitude", f"{value[1]:.4g} m"))


def _traced_again(life: _Life, span: float, lost: MotionLostError) -> bool:
    """A further state just beyond the last one with motions of responses traced anew; False where there are none.

    The state goes beyond the fold at which a motion ends: ten times farther where the last trace was of no avail.
    """
    last, reason = life.states[-1], str(lost)
    life.jumps += 1
    near = last.place - life.jump[0] < 10.0 * life.jump[1]
    beyond = 10.0 * life.jump[1] if near else JUMP * span
    state = np.append(last.work, last.other)
    if not isinstance(lost, RangeLeftError) and life.jumps <= MOST_JUMPS and last.place + beyond < span:
        life.motions, life.depth = last.motions, life.depth_per_joule * last.work
        state = state + beyond * life.rate(last.place, state)
        depth = life.depth_per_joule * state[:-1]
        try:
            motions = tuple(each.traced(depth) for each in life.followers)
        except MotionLostError as error:
            reason = str(error)
        else:
            life.motions, life.depth, life.jump = motions, depth, (last.place + beyond, beyond)
            life.states.append(life.reached(last.place + beyond, state))
            pairs = zip(last.motions, motions, strict=True)
            if any(abs(new.amplitude / old.amplitude - 1.0) > SAME for old, new in pairs):
                life.events.append((last.place, last.other, "jump", reason))
            return True
    life.events.append((last.place, last.other, "lost", reason))
    return False


def _history(life: _Life, span: float) -> WearHistory:
    """The history of a life."""
    states, contact = life.states, life.followers[0].problem.contact
    work = np.array([each.work for each in states])
    depth = work * life.depth_per_joule
    slow = np.array([[each.place, each.other] for each in states]).T
    motions = [each.motions for each in states]

    def counted(state: int) -> NDArray[np.int64]:
        return np.array([[np.count_nonzero(m.state == state) for m in each] for each in motions])

    def times(place: float, other: float) -> tuple[float, float]:
        return (other, place) if life.over_cycles else (place, other)

    time, cycles = times(slow[0], slow[1])  # type: ignore[arg-type]
    return WearHistory(
        time_s=np.asarray(time),
        cycles=np.asarray(cycles),
        work_j=work,
        volume_m3=work * life.coefficient,
        depth_m=depth,
        interference_m=contact.interference - depth,
        amplitude_m=np.array([[m.amplitude for m in each] for each in motions]),
        frequency_hz=np.array([[m.frequency_hz for m in each] for each in motions]),
        load_n=np.array([life.load(each).sum(axis=1) for each in motions]),
        power_w=np.array([life.power(each) for each in motions]),
        sticking=counted(STICK),
        slipping=counted(SLIP),
        separating=counted(LIFT_OFF),
        events=tuple(
            WearEvent(kind, *times(place, other), said)
            for place, other, kind, said in sorted(life.events, key=lambda each: each[0])
        ),
        error_m=float(life.error.max()),
        evaluations=life.evaluations,
        traces=sum(each.traces for each in life.followers),
        complete=bool(states[-1].place >= span),
    )

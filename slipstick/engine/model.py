"""The linear model of a machine's parts about a state of their parameters and laws.

Every parameter, law and error is a change of a parameter, a quantity or an input of the equations, or of what a sensor
reads, so that all columns are linear responses along the trajectory. Columns that differ between runs by a factor only,
such as those of laws over what is constant in a run, are one whitened row and their factors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import call
from typing import Any

import numpy as np

from slipstick.engine.bases import late
from slipstick.engine.equations import OwnLaw, Problem, cut, refine
from slipstick.engine.laws import GAIN, Candidate
from slipstick.engine.recordings import Pair, Part, Recorded, Term, clock_of, pose_nominal, read_track
from slipstick.engine.trajectory import Trajectory, solve
from slipstick.engine.whitening import CarriedNoise, Whitening, join_steps
from slipstick.machine.declaration import SENSOR, Namespace, identifier_of
from slipstick.numerics.threads import mapped

_LATER = 0.01
"""Step of the derivative with the clock, in samples."""

Key = tuple[str, str]
"""What a row is the response to: "parameter", "quantity", "input" or "sensor", and its name; or "clock"."""


@dataclass(frozen=True, eq=False)
class State:
    """Where a fit is: `points` (n, r) of the random terms with `means` (r,), `shared` (s,) values, and `laws` by pair.
    """

    points: np.ndarray
    means: np.ndarray
    shared: np.ndarray
    laws: Mapping[Pair, np.ndarray]

    def take(self, rows: slice | np.ndarray) -> "State":
        """Return the state of the runs `rows`."""
        return replace(self, points=self.points[rows])


@dataclass(frozen=True, eq=False)
class PartModel:
    """A part about a state: its smooth `trajectory`, its `predicted` signals (n, o, k), and whitened rows.

    `noisy` (n, o, k) is the response to the noise of measured inputs. `signals` (n, o, K) are what the sensors read
    without errors: those of the trajectory, or measured ones at samples for which a part without states does not hold.

    `rows` (n, r + 1, o k) are the responses to the `keys` of terms and laws between runs, then those of laws within
    runs, then the residual, and `gram` (n, r + 1, r + 1) their products; the sensors are late by `clocks` (o,), in
    samples. `places` are the rows of each law within runs.
    """

    part: Part
    state: State
    laws: Mapping[Pair, Candidate]
    trajectory: Trajectory
    noisy: np.ndarray
    signals: np.ndarray
    predicted: np.ndarray
    clocks: tuple[float, ...]
    whitening: Whitening | None
    keys: tuple[Key, ...]
    places: Mapping[Pair, slice]
    rows: np.ndarray
    gram: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """What is measured beyond the prediction (n, o, k), in the units of the signals."""
        return np.asarray(self.part.measured - self.predicted)

    def white(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (n, c, o, k) whitened, (n, c, o k)."""
        assert self.whitening is not None
        white = self.whitening.apply(columns)
        temper = self.part.temper
        return white if (temper == 1).all() else white / np.sqrt(temper)[:, None, None]

    def late(self, signals: np.ndarray, every: int) -> np.ndarray:
        """Return each `every`-th instant of signals (..., o, K), read by sensors that are late."""
        read = [late(signals[..., place, :], self.part.fine * clock, every) for place, clock in enumerate(self.clocks)]
        return read[0][..., None, :] if len(read) == 1 else np.stack(read, axis=-2)

    def read(self, every: int) -> np.ndarray:
        """Return what the sensors read without noise (n, o, K) at each `every`-th instant."""
        return self.late(self.signals + sensor_errors(self), every)

    @cached_property
    def passed(self) -> dict[str, np.ndarray]:
        """Share (n, K) of the noise of inputs that is left after errors of their sensors over their own signals."""
        passed = {name: np.ones((len(self.part.measured), self.trajectory.outputs.shape[2]))
                  for name in self.part.read.values()}
        for pair, law in self.laws.items():
            kind, name = key_of_law(law, self.part)
            if kind == "input" and pair[1] == GAIN:
                variable, by = law.variables[self.part.name], self.part.noise[name].std
                c, values = law.size * self.state.laws[pair], self.part.inputs[name]
                above, below = (replace(variable, values=values + each).weigh(c) for each in (by, -by))
                passed[name] -= (above - below) / (2 * by)
        return passed

    def carry(self, noise: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the response (n, o, k) to the noise (n, k) of measured inputs.

        It is linear: equations that are driven by noise would be off by their curvature.
        """
        part, trajectory = self.part, self.trajectory
        carried = np.zeros(trajectory.outputs.shape)
        for name, values in noise.items():
            size = part.noise[name].std if name in part.noise else float(np.abs(part.inputs[name]).max()) or 1.0
            carried += trajectory.respond(trajectory.direction("input", name, size),
                                          (self.passed[name] * refine(values, part.fine))[:, None])[:, 0]
        return carried[:, :, ::part.fine]

    def find_carried(self) -> CarriedNoise | None:
        """Return how the noise of measured inputs and disturbances, linear between samples, reach the output."""
        part, trajectory = self.part, self.trajectory
        whole = np.ones((len(part.measured), trajectory.outputs.shape[2]))
        sources = [(trajectory.direction("input", name, noise.std), self.passed[name])
                   for name, noise in part.noise.items()]
        sources += [(trajectory.direction("quantity", name, _size_of(part, name)), whole) for name in part.disturbances]
        if not sources:
            return None
        n, fine = len(part.measured), part.fine
        E = np.stack([direction.D[:, :, ::fine] * passed[:, None, ::fine] for direction, passed in sources], axis=-1)
        A, F, G = join_steps(trajectory.A, np.stack([direction.B for direction, _ in sources]),
                             np.stack([passed for _, passed in sources]), fine)
        loudness = np.concatenate([part.input_loudness, np.ones((n, len(part.disturbances)))], axis=1)
        return CarriedNoise((*part.noise.values(), *part.disturbances.values()), loudness, A, F, G,
                            trajectory.C[:, :, ::fine], E)

    def own(self) -> dict[str, np.ndarray]:
        """Return the values (n, K) of the part's own variables: the signals that it gives, and those of the system."""
        return _list_own(self.part, self.trajectory)

    @cached_property
    def _own_halfway(self) -> dict[str, np.ndarray] | None:
        """The values (n, K - 1) of the system's own variables in the middle of each step, where these are known."""
        if self.trajectory.halfway is None:
            return None
        problem, x = self.trajectory.halfway
        return {name: np.broadcast_to(values, x[:, 0].shape) for name, values in _read_own(problem, x).items()}

    def law_columns(self, candidate: Candidate) -> np.ndarray:
        """Return the columns (n, m, o, k) of a law; (n, 1, o, k) of one between runs, for a factor of 1."""
        part, variable = self.part, candidate.variables[self.part.name]
        kind, name = key_of_law(candidate, part)
        n, _, size = self.trajectory.outputs.shape
        if variable.kind == "between":
            return _respond(self, kind, name, candidate.size, np.ones((n, 1, size)))
        own = drawn = first = halfway = None
        if variable.values is None:
            own = _read_variable(self, variable.name, name) if kind == "sensor" else self.own()[variable.name]
            if kind != "sensor" and self._own_halfway is not None:
                halfway = candidate.size * variable.basis(self._own_halfway[variable.name])
            if variable.kind == "lags" and name in part.drawn:
                drawn = candidate.size * variable.basis(part.inputs[part.drawn[name]])
            if kind == "sensor" and part.begins[name]:
                first = candidate.size * variable.basis(_begin_variable(part, variable.name, name))
        return _respond(self, kind, name, candidate.size, candidate.size * variable.basis(own), drawn, first,
                        halfway)


def is_between(candidate: Candidate) -> bool:
    """Whether a law is over what is constant in a run."""
    return candidate.variable.kind == "between"


def nominal_own_values(part: Part) -> dict[str, np.ndarray]:
    """Return the values (n, K) of a part's own variables at nominal parameters, of measured states where all are."""
    problem, track = pose_nominal(part), read_track(part)
    return _read_own(problem, solve(problem).x if track is None else track)


def _list_own(part: Part, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return the values (n, K) of a part's own variables along a trajectory."""
    outputs, own = trajectory.outputs, _read_own(trajectory.problem, trajectory.x)
    signals = {signal: outputs[:, place] for place, signal in enumerate(part.signals)}
    return signals | {name: np.broadcast_to(values, outputs[:, 0].shape) for name, values in own.items()}


def _read_own(problem: Problem, x: np.ndarray) -> dict[str, np.ndarray]:
    """Return the own variables of a problem at states (n, d, K)."""
    named = Namespace(**{name: x[:, place] for place, name in enumerate(problem.system.states)})
    u, p = Namespace(**problem.inputs), Namespace(**problem.parameters)
    return {name: read(named, u, p) for name, read in problem.system.own.items()}


def build_part(recorded: Recorded, part: Part, state: State, laws: Mapping[Pair, Candidate],
               is_fixed: bool = False) -> PartModel:
    """Return the linear model of a part with the `laws` of a state, which have no rows if they are fixed."""
    model = predict_part(recorded, part, state, laws)
    model = replace(model, whitening=Whitening.of(part.counted, part.sensors, part.loudness, model.find_carried()))
    terms = [term for term in recorded.terms if touches(term, part)]
    varied = {} if is_fixed else model.laws
    keys = tuple(dict.fromkeys([key_of_term(term) for term in terms]
                               + [key_of_law(law, part) for law in varied.values() if is_between(law)]))
    within = {pair: law for pair, law in varied.items() if not is_between(law)}
    ends = len(keys) + np.cumsum([0, *(law.count for law in within.values())])
    places = {pair: slice(first, last) for pair, first, last in zip(within, ends[:-1], ends[1:], strict=True)}
    columns = mapped(call, [*(partial(_row, model, key, recorded) for key in keys),
                            *(partial(model.law_columns, law) for law in within.values())])
    rows = model.white(np.concatenate([*columns, model.residual[:, None]], axis=1))
    return replace(model, keys=keys, places=places, rows=rows, gram=rows @ rows.transpose(0, 2, 1))


def move_part(recorded: Recorded, model: PartModel, state: State) -> PartModel:
    """Return a part at another state, without rows, with products of the columns of a model and another residual.

    The response to the noise of inputs is kept as well. What it changes is correlated with the residual, so that
    parameters of the least squares would be biased by errors in variables.
    """
    there = predict_part(recorded, model.part, state, model.laws, model.noisy)
    residual, gram = model.white(there.residual[:, None]), model.gram.copy()
    gram[:, -1, :-1] = gram[:, :-1, -1] = (model.rows[:, :-1] @ residual[:, 0, :, None])[..., 0]
    gram[:, -1, -1] = (residual**2).sum(axis=(1, 2))
    return replace(there, whitening=model.whitening, keys=model.keys, places=model.places, gram=gram)


def predict_part(recorded: Recorded, part: Part, state: State, laws: Mapping[Pair, Candidate],
                 noisy: np.ndarray | None = None) -> PartModel:
    """Return the model of a part at a state, without rows, with the response to the noise of inputs if it is known."""
    laws = {pair: law for pair, law in laws.items() if part.name in law.variables}
    trajectory = solve(_pose(recorded, part, state, laws))
    signals = trajectory.outputs
    if not part.system.states:
        smooth = np.stack([recorded.fine(name, part) for name in part.signals], axis=1)
        signals = np.where(part.counted[:, :, part.nearest], signals, smooth)
    clocks = tuple(_clock(recorded, clock_of(part, signal), state) for signal in part.signals)
    nothing = np.empty(0)
    model = PartModel(part, state, laws, trajectory, nothing, signals, nothing, clocks, None, (), {}, nothing, nothing)
    if noisy is None:
        noisy = model.carry(part.beyond)
    # The errors and the lateness of sensors are those of the smooth signals: a late noise would be an average.
    read = model.read(part.fine) - signals[:, :, ::part.fine]
    return replace(model, noisy=noisy, predicted=read + trajectory.outputs[:, :, ::part.fine] + noisy)


def touches(term: Term, part: Part) -> bool:
    """Whether a term acts in a part."""
    if term.kind == "clock":
        return term.place in [clock_of(part, signal) for signal in (*part.signals, *part.noise)]
    return term.place in part.parameters


def key_of_term(term: Term) -> Key:
    """Return the key of a term."""
    return term.kind, term.place


def key_of_law(law: Candidate, part: Part) -> Key:
    """Return the key of a law in a part."""
    if law.quantity.name.endswith(SENSOR):
        signal = law.quantity.name.removesuffix(SENSOR)
        return ("sensor", signal) if signal in part.signals else ("input", identifier_of(signal))
    return "quantity", identifier_of(law.quantity.name)


def _clock(recorded: Recorded, place: str, state: State) -> float:
    return next((float(value) for term, value in zip(recorded.shared, state.shared, strict=True)
                 if term.kind == "clock" and term.place == place), 0.0)


def _pose(recorded: Recorded, part: Part, state: State, laws: Mapping[Pair, Candidate]) -> Problem:
    """Return the equations of a part at a state, driven by inputs without noise."""
    parameters = dict(part.parameters)
    for terms, values in ((recorded.random, state.points.T), (recorded.shared, state.shared)):
        for term, value in zip(terms, values, strict=True):
            if term.kind == "parameter" and term.place in parameters:
                parameters[term.place] = term.change(parameters[term.place], value)
    quantities: dict[str, Any] = dict(part.quantities)
    driving, inner = dict(part.inputs), list[OwnLaw]()
    for signal, name in part.read.items():  # late
        driving[name] = late(part.inputs[name], -part.fine * _clock(recorded, clock_of(part, signal), state), 1)
    for pair, law in laws.items():
        kind, name = key_of_law(law, part)
        if kind == "sensor":
            for begin in part.begins[name]:  # the sensor has read the nominal value
                variable = law.variables[part.name]
                first = _begin_variable(part, variable.name, name) if variable.values is None else None
                error = variable.weigh(law.size * state.laws[pair], first)
                parameters[begin] = parameters[begin] - error[:, :1]
            if name not in part.drawn:
                continue
            kind, name = "input", part.drawn[name]
        variable, c = law.variables[part.name], law.size * state.laws[pair]
        if variable.kind == "own":
            place = part.block.states.index(variable.name) if variable.jumps else None
            # An error of the sensor is taken off what it reads.
            is_input = kind == "input"
            inner.append(OwnLaw("input" if is_input else "quantity", name, variable.name, variable.knots,
                                -c if is_input else c, place))
        elif kind == "input":
            driving[name] = driving[name] - variable.weigh(c, part.inputs[name])
        else:
            quantities[name] = quantities[name] + variable.weigh(c)
    if not driving:
        driving["time"] = np.zeros((len(part.measured), part.instants))
    return Problem(part.system, part.step, driving, quantities, parameters, tuple(inner))


def sensor_errors(model: PartModel) -> np.ndarray:
    """Return what the sensors read too much (n, o, K) of the signals."""
    errors: np.ndarray = np.zeros_like(model.signals)
    for pair, law in model.laws.items():
        kind, name = key_of_law(law, model.part)
        if kind == "sensor":
            variable, c = law.variables[model.part.name], law.size * model.state.laws[pair]
            own = _read_variable(model, variable.name, name) if variable.values is None else None
            errors[:, model.part.signals.index(name)] += variable.weigh(c, own)
    return errors


def _read_variable(model: PartModel, variable: str, signal: str) -> np.ndarray:
    """Return the values (n, K) of an own variable over which the sensor of a `signal` is off.

    The signal itself is what the sensor reads.
    """
    return model.signals[:, model.part.signals.index(signal)] if variable == signal else model.own()[variable]


def _begin_variable(part: Part, variable: str, signal: str) -> np.ndarray:
    """Return the nominal values (n, 1) at the begin of the runs of an own variable over which a sensor is off."""
    if variable == signal:
        return part.parameters[part.begins[signal][0]]
    problem = pose_nominal(part)
    return _list_own(part, solve(replace(problem, inputs=cut(problem.inputs, slice(0, 2)))))[variable][:, :1]


def _size_of(part: Part, name: str) -> float:
    """Return the size of a large change of a quantity, by its identifier."""
    return next(each.size for each in part.block.quantities if identifier_of(each.name) == name)


def _row(model: PartModel, key: Key, recorded: Recorded) -> np.ndarray:
    """Return the response (n, 1, o, k) to a change of 1."""
    part, (kind, name) = model.part, key
    n, o, size = model.trajectory.outputs.shape
    if kind == "parameter":
        change = model.trajectory.respond_to_parameter(name, _typical(recorded, model, key))
        return _read(model, _unit(recorded, model, key)[..., None] * change)
    if kind != "clock":
        return _respond(model, kind, name, _typical(recorded, model, key), np.ones((n, 1, size)))
    names = (*part.signals, *part.noise)
    place = [clock_of(part, signal) for signal in names].index(name)
    if place >= o:
        return _respond_to_clock(model, names[place], _clock(recorded, name, model.state))
    whole = (model.signals + sensor_errors(model))[:, place]
    before, after = (late(whole, part.fine * (model.clocks[place] + by), part.fine) for by in (-_LATER, _LATER))
    column = np.zeros((n, 1, o, before.shape[1]))
    if names[place] in part.drawn:
        column = _respond_to_clock(model, part.drawn[names[place]], model.clocks[place])
    column[:, 0, place] += (after - before) / (2 * _LATER)
    return column


def _respond_to_clock(model: PartModel, name: str, clock: float) -> np.ndarray:
    """Return the response (n, 1, o, k) to a change by 1 of how late an input is read."""
    part = model.part
    ahead, behind = (late(part.inputs[name], -part.fine * (clock + by), 1) for by in (_LATER, -_LATER))
    # An input is taken off by what its sensor reads too much.
    return -_respond(model, "input", name, 1.0, (ahead - behind)[:, None] / (2 * _LATER))


def _unit(recorded: Recorded, model: PartModel, key: Key) -> np.ndarray:
    """Return the changes (n, 1, 1) of a parameter with the coefficient of its term."""
    term = _term_of(recorded, key)
    if term.is_factor:
        return np.asarray(model.trajectory.problem.parameters[term.place])[:, :, None]
    return np.full((1, 1, 1), term.size)


def _term_of(recorded: Recorded, key: Key) -> Term:
    return next(term for term in recorded.terms if key_of_term(term) == key)


def _typical(recorded: Recorded, model: PartModel, key: Key) -> float:
    """Return a magnitude for numerical derivatives."""
    kind, name = key
    if kind == "parameter":
        term = _term_of(recorded, key)
        return term.size * float(np.abs(term.values).max() or 1.0)
    if kind == "quantity":
        return _size_of(model.part, name)
    return 1.0


def _respond(model: PartModel, kind: Any, name: str, size: float, basis: np.ndarray,
             drawn: np.ndarray | None = None, first: np.ndarray | None = None,
             halfway: np.ndarray | None = None) -> np.ndarray:
    """Return the changes (n, m, o, k) of what the sensors read, with a change along a basis (n, m, K).

    An error of a sensor to which a state is drawn has the basis `drawn` (n, m, K) there, where that is another one, and
    in a parameter that is nominally the `first` sample (n, m, 1) of its signal. A basis that is not linear over each
    step has the values `halfway` (n, m, K - 1).
    """
    part, trajectory = model.part, model.trajectory
    n, o, instants = trajectory.outputs.shape
    if kind == "sensor":
        change = np.zeros((n, basis.shape[1], o, instants))
        change[:, :, part.signals.index(name)] = basis
        read = model.late(change, model.part.fine)
        for begin in part.begins[name]:
            nominal = basis[:, :, :1] if first is None else first
            read -= _respond(model, "parameter", begin, size, np.repeat(nominal, instants, axis=2))
        if name in part.drawn:
            read += _respond(model, "input", part.drawn[name], size, basis if drawn is None else drawn)
        return read
    typical = part.noise[name].std if kind == "input" and name in part.noise else size
    change = trajectory.respond(trajectory.direction(kind, name, typical), basis, halfway)
    return _read(model, -change if kind == "input" else change)  # an error of the sensor is taken off what it reads


def _read(model: PartModel, change: np.ndarray) -> np.ndarray:
    """Return the changes (n, m, o, k) of what sensors read, with changes (n, m, o, K) of their signals."""
    # Errors of sensors over signals of the part. Those over states that nobody measures move too, by next to nothing.
    part, through = model.part, list[tuple[int, np.ndarray]]()
    for pair, law in model.laws.items():
        which, name = key_of_law(law, part)
        variable = law.variables[part.name]
        if which == "sensor" and variable.values is None and variable.name in part.signals:
            c, values = law.size * model.state.laws[pair], _read_variable(model, variable.name, name)
            through.append((part.signals.index(name), variable.differentiate(
                c, values, change[:, :, part.signals.index(variable.name)])))
    for place, more in through:
        change[:, :, place] += more
    return model.late(change, part.fine)

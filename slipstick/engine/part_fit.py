"""The linear model of a part with all its runs, computed by chunks of these, so that memory hardly grows with them.

Products and predicted signals are held. What is larger, the columns and the derivatives of trajectories, is
held within a fit as far as there is room, and is otherwise computed again where it is needed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from slipstick.engine.laws import Candidate, take_all
from slipstick.engine.model import Key, PartModel, State, build_part, move_part, predict_part
from slipstick.engine.recordings import Pair, Part, Recorded
from slipstick.engine.whitening import CarriedNoise
from slipstick.numerics.threads import mapped

_TOGETHER = 100_000
"""Instants of a chunk: equations that must be integrated in sequence take as long for a hundred runs as for one."""
_ROOM = 1 << 30
"""Bytes for columns that a part holds in a fit; those of further chunks are computed at each step."""

Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class PartFit:
    """A part at a `state`, with the columns of the state at which it was `built`.

    What it has is that of a `PartModel`, but of all n runs: products `gram` (n, r + 1, r + 1) of rows with `keys` and
    `places`, and `noisy` and `predicted` signals (n, o, k). `held` are the models of the first
    chunks. Laws that are fixed have no rows.
    """

    recorded: Recorded
    part: Part
    laws: Mapping[Pair, Candidate]
    built: State
    state: State
    keys: tuple[Key, ...]
    places: Mapping[Pair, slice]
    gram: np.ndarray
    noisy: np.ndarray
    predicted: np.ndarray
    held: tuple[PartModel, ...] = ()
    is_fixed: bool = False

    @property
    def residual(self) -> np.ndarray:
        """What is measured beyond the prediction (n, o, k), in the units of the signals."""
        return np.asarray(self.part.measured - self.predicted)

    def release(self) -> "PartFit":
        """Return the model without columns."""
        return replace(self, held=())

    def take(self, rows: np.ndarray, recorded: Recorded, laws: Mapping[Pair, Candidate]) -> "PartFit":
        """Return the model of the runs `rows`, which are `recorded` with these laws, without columns."""
        part = next(part for part in recorded.parts if part.name == self.part.name)
        chosen = {pair: laws[pair] for pair in self.laws}
        return replace(self, recorded=recorded, part=part, laws=chosen, built=self.built.take(rows),
                       state=self.state.take(rows), gram=self.gram[rows], noisy=self.noisy[rows],
                       predicted=self.predicted[rows], held=())

    def move(self, state: State) -> "PartFit":
        """Return the model at another state, with the same columns and the same response to noise."""
        held = [*self.held, *(None for _ in _list_slices(self.part)[len(self.held):])]
        chunks = self._spread(_move, lambda rows, number: (
            self.built.take(rows), state.take(rows), held[number], self.is_fixed))
        return replace(_gather(replace(self, state=state), chunks), held=self.held)

    def own(self) -> dict[str, np.ndarray]:
        """Return the values (n, K) of the part's own variables: the signals that it gives, and those of the system."""
        own = self._predict(PartModel.own)
        return {name: np.concatenate([each[name] for each in own]) for name in own[0]}

    def read(self, every: int) -> np.ndarray:
        """Return what the sensors read without noise (n, o, K) at each `every`-th instant."""
        return np.concatenate(self._predict(partial(PartModel.read, every=every)))

    def carry(self, noise: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the response (n, o, k) to the noise (n, k) of measured inputs."""
        return np.concatenate(self._spread(_predict, lambda rows, _: (
            self.state.take(rows), self.noisy[rows],
            partial(PartModel.carry, noise={name: values[rows] for name, values in noise.items()}))))

    def find_carried(self) -> list[tuple[slice, CarriedNoise | None]]:
        """Return how the noise of inputs and disturbances reaches the signals, by slices of runs."""
        return list(zip(_list_slices(self.part), self._predict(PartModel.find_carried), strict=True))

    def multiply(self, candidates: Sequence[Candidate]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return products of the columns of laws with all rows (n, m, r + 1), and with each other (n, m, m).

        A law between runs has one column, for a factor of 1.
        """
        chunks = self._spread(_multiply, lambda rows, _: (
            self.built.take(rows), take_all(candidates, rows)))
        return [(np.concatenate([chunk[place][0] for chunk in chunks]),
                 np.concatenate([chunk[place][1] for chunk in chunks])) for place in range(len(candidates))]

    def _predict(self, read: Callable[[PartModel], Value]) -> list[Value]:
        """Return what is read of a model of each chunk without columns."""
        return self._spread(_predict, lambda rows, _: (self.state.take(rows), self.noisy[rows], read))

    def _spread(self, function: Callable[..., Value], give: Callable[[slice, int], tuple[Any, ...]]) -> list[Value]:
        return _spread(self.recorded, self.part, self.laws, function, give)


def fit_part(recorded: Recorded, part: Part, state: State, laws: Mapping[Pair, Candidate],
             is_fixed: bool = False, holds: bool = True) -> PartFit:
    """Return the linear model of a part with the `laws` of a state; it `holds` columns as far as there is room."""
    laws = {pair: law for pair, law in laws.items() if part.name in law.variables}
    held = _count_held(recorded, part, laws) if holds and recorded.executor is None else 0
    nothing = np.empty(0)
    empty = PartFit(recorded, part, laws, state, state, (), {}, nothing, nothing, nothing, is_fixed=is_fixed)
    return _gather(empty, _spread(recorded, part, laws, _build, lambda rows, number: (
        state.take(rows), number < held, is_fixed)))


def _list_slices(part: Part) -> list[slice]:
    count = len(part.measured)
    chunks = -(-count * part.instants // _TOGETHER)
    ends = [count * chunk // chunks for chunk in range(chunks + 1)]
    return [slice(first, last) for first, last in pairwise(ends) if last > first]


def _count_held(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate]) -> int:
    """Return for how many chunks there is room: a column is about as large as what is known of a run beside them."""
    columns = 1 + len(recorded.random) + len(recorded.shared) + sum(law.count for law in laws.values())
    chunks = _list_slices(part)
    return int(_ROOM / (2 * columns * part.measured.nbytes / len(chunks)))


def _spread(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate], function: Callable[..., Value],
            give: Callable[[slice, int], tuple[Any, ...]]) -> list[Value]:
    """Return what a function makes of each chunk of runs, and of what is given for it: by the executor or threads."""
    slices = _list_slices(part)
    alone = replace(recorded, parts=(), executor=None)  # parts are large

    def take(number: int) -> tuple[Any, ...]:
        rows = slices[number]
        chosen = {pair: law.take(rows) for pair, law in laws.items()}
        return (alone.take(rows), part.take(rows), chosen, *give(rows, number))

    if len(slices) == 1:
        return [function(replace(recorded, executor=None), part, laws, *give(slice(None), 0))]
    if recorded.executor is not None:
        futures = [recorded.executor.submit(function, *take(number)) for number in range(len(slices))]
        return [future.result() for future in futures]
    return mapped(lambda number: function(*take(number)), range(len(slices)))


def _gather(whole: PartFit, chunks: Sequence[PartFit]) -> PartFit:
    """Return the model of all runs with what chunks of them have."""
    def join(arrays: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate(arrays) if len(arrays) > 1 else arrays[0]

    return replace(whole, keys=chunks[0].keys, places=chunks[0].places, gram=join([each.gram for each in chunks]),
                   noisy=join([each.noisy for each in chunks]),
                   predicted=join([each.predicted for each in chunks]),
                   held=tuple(model for each in chunks for model in each.held))


def _summarize(model: PartModel, recorded: Recorded, is_held: bool) -> PartFit:
    """Return what is held of the model of a chunk."""
    slim = replace(model, trajectory=replace(model.trajectory, _known={}))
    return PartFit(recorded, model.part, model.laws, model.state, model.state, model.keys, model.places, model.gram,
                   model.noisy, model.predicted, (slim,) if is_held else ())


def _build(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate], state: State, is_held: bool,
           is_fixed: bool) -> PartFit:
    return _summarize(build_part(recorded, part, state, laws, is_fixed), recorded, is_held)


def _move(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate], built: State, state: State,
          held: PartModel | None, is_fixed: bool) -> PartFit:
    model = held or build_part(recorded, part, built, laws, is_fixed)
    return _summarize(move_part(recorded, model, state), recorded, is_held=False)


def _predict(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate], state: State, noisy: np.ndarray,
             read: Callable[[PartModel], Value]) -> Value:
    return read(predict_part(recorded, part, state, laws, noisy))


def _multiply(recorded: Recorded, part: Part, laws: Mapping[Pair, Candidate], built: State,
              candidates: Sequence[Candidate]) -> list[tuple[np.ndarray, np.ndarray]]:
    model = build_part(recorded, part, built, laws)
    rows = model.rows.transpose(0, 2, 1)

    def multiply(candidate: Candidate) -> tuple[np.ndarray, np.ndarray]:
        white = model.white(model.law_columns(candidate))
        return white @ rows, white @ white.transpose(0, 2, 1)

    return mapped(multiply, candidates)

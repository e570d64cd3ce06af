"""Fits without laws, of the runs that are not set aside, with the noise that they leave and tempered by the rest."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from slipstick.engine.approach import approach
from slipstick.engine.disturbances import estimate_disturbances, estimate_input_noise
from slipstick.engine.doing import Doing, Log
from slipstick.engine.equations import refine
from slipstick.engine.fit import Fit, begin, fit
from slipstick.engine.laws import FINER, list_curves
from slipstick.engine.model import State, nominal_own_values
from slipstick.engine.noise import (
    CORRELATIONS,
    LAGS,
    LONGER,
    Carried,
    Differences,
    Noise,
    SecondDifferences,
    bound_noise,
    draw_noise,
    estimate_loudness,
    estimate_residual_noise,
    second_variances,
)
from slipstick.engine.part_fit import PartFit
from slipstick.engine.preparation import straighten
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Part, Recorded, explain
from slipstick.engine.settings import EngineSettings
from slipstick.machine.declaration import Machine, identifier_of
from slipstick.numerics.deviations import from_median

_LEAST_CHI = 1e-3
"""Least chi-square of a run: one without samples that count has none."""
_TEMPERED = 6
"""Most rounds in which what a part leaves is found to count as noise."""
RENEWED = 2
"""Times that noise and explained signals follow from a fit: what a drawn state has of its own noise fades each time,
and the noise of a part is that which it leaves with explained inputs."""
_CLOCKS = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
"""Clocks at which a fit is tried, in standard deviations of the prior: a sample, in quarters."""


def settle(recorded: Recorded, settings: EngineSettings, log: Log = lambda _: None) -> list[Fit]:
    """Return the fits without laws of the groups of parts, of the runs that are not set aside.

    They have the noise of sensors that their residuals show.
    """
    fits, explained, most = list[Fit](), dict[str, np.ndarray](), int(settings.most_outlying * len(recorded))
    waiting = recorded.groups()
    while waiting:
        group = explain(waiting.pop(0), explained)
        log(Doing("fit", f"Fitting the parameters of {' and '.join(f'“{part.name}”' for part in group.parts)}"))
        fitted = temper(fit_bare(group), settings, begin(group))
        if any((part.temper > 1).any() for part in fitted.recorded.parts) or len(find_outlying([fitted], settings)):
            state, left = approach(fitted.recorded)
            bad = _choose_worst(_deviate(_logarithm(left), settings.least_spread), settings)
            if len(recorded) - len(group) + len(bad) <= most:  # no step of all runs is one of these as well
                kept = np.delete(np.arange(len(group)), bad)
                state, fitted = state.take(kept), fitted.take(kept)
                fits, waiting = [each.take(kept) for each in fits], [each.take(kept) for each in waiting]
                explained = {name: signal[kept] for name, signal in explained.items()}
            fitted = temper(_try_clocks(fitted.restart(state, state.points.var(axis=0))), settings)
        fits.append(fitted)
        explained |= explain_signals(fitted, settings)
    for number in range(1 + RENEWED):
        if number:  # bad runs have a share in the noise that the signals show
            fits = renew(fits, fits, settings)
        while (len(bad := _choose_worst(_doubt(fits, settings), settings))
               and len(recorded) - len(fits[0].recorded) + len(bad) <= most):
            kept = np.delete(np.arange(len(fits[0].recorded)), bad)
            fits = [taken if each.converged else fit(taken.recorded, taken.laws, taken.priors, taken.state)
                    for each in fits for taken in [each.take(kept)]]  # what has converged hardly changes
    return fits


def find_outlying(fits: Sequence[Fit], settings: EngineSettings) -> np.ndarray:
    """Return the runs that are far worse than the others."""
    return np.flatnonzero(_doubt(fits, settings) > settings.outlying)


def are_like(fits: Sequence[Fit], others: Sequence[Fit], settings: EngineSettings) -> np.ndarray:
    """Return whether runs (n,) are not far worse than those of other fits of the same parts."""
    usual = {name: _logarithm(chi) for each in others for name, chi in each.chi_square.items()}
    worse = [_deviate(_logarithm(chi), settings.least_spread, usual[name])
             for each in fits for name, chi in each.chi_square.items()]
    return np.asarray(np.max(worse, axis=0) < settings.outlying)


def _try_clocks(fitted: Fit) -> Fit:
    """Return the better one of a fit and of one from those clocks at which it predicts the signals best.

    Where a signal jumps between two samples, residuals do not tell of the way to the right clock.
    """
    def move(state: State, place: int, value: float) -> State:
        shared = state.shared.copy()
        shared[place] = value
        return replace(state, shared=shared)

    def measure(state: State) -> float:
        return sum(float(model.move(state).gram[:, -1, -1].sum()) for model in fitted.models.values())

    state = fitted.state
    for place, term in enumerate(fitted.recorded.shared):
        if term.kind == "clock":
            tried = [move(state, place, term.target + away * term.std) for away in _CLOCKS]
            state = min([state, *tried], key=measure)
    return fitted if state is fitted.state else fitted.restart(state, fitted.fitted.variance)


def temper(fitted: Fit, settings: EngineSettings, origin: State | None = None) -> Fit:
    """Return a fit in which what the parts leave beyond noise counts as noise, of each run where these are set aside.

    Parameters are not driven far away by what is missing, and what a law leaves of a strong effect is weighed by its
    own size (quasi-likelihood: McCullagh and Nelder, Generalized Linear Models, 1989, chapter 9). A fit without laws
    that may already be far away begins again at its `origin`.
    """
    def weigh(chi: np.ndarray) -> np.ndarray:
        left = chi if fitted.recorded.set_aside else np.full(len(chi), _trim(chi, settings.most_outlying))
        return np.where(left > 1 + settings.unexplained, left, 1.0)

    for _ in range(_TEMPERED):
        wanted = {name: weigh(chi) for name, chi in fitted.chi_square.items()}
        pairs = [(part.temper, wanted[part.name]) for part in fitted.recorded.parts]
        # Near what counts already is near enough, but for nothing that is left.
        if all(np.where(then == 1, now == 1, np.abs(np.log(then / now)) < settings.unexplained).all()
               for now, then in pairs):
            break
        hotter = any((then > 2 * now).any() for now, then in pairs)
        recorded = replace(fitted.recorded, parts=tuple(replace(part, temper=wanted[part.name])
                                                        for part in fitted.recorded.parts))
        fitted = fitted.again(recorded, origin if hotter else None)
    return fitted


def _trim(chi: np.ndarray, share: float) -> float:
    """Return the mean of chi-squares (n,) without the largest share of them."""
    return float(np.sort(chi)[:len(chi) - int(share * len(chi))].mean())


def _choose_worst(doubt: np.ndarray, settings: EngineSettings) -> np.ndarray:
    """Return the runs with the largest of deviations (n,) beyond what is usual: without them, others may look better.
    """
    return np.flatnonzero(doubt > max(settings.outlying, 0.5 * float(doubt.max())))


def renew(fits: Sequence[Fit], shown: Sequence[Fit], settings: EngineSettings) -> list[Fit]:
    """Return fits with the noise that those `shown` leave, with signals as these explain them, and tempered anew.

    A fit that is not shown itself, and reads nothing of these signals, keeps its state.
    """
    explained = {name: signal for each in shown for name, signal in explain_signals(each, settings).items()}
    quiet = {each: renew_noise(each) for each in shown}
    given = {identifier_of(signal): (part.sensors[place], part.loudness[:, place])
             for each in quiet.values() for part in each.parts for place, signal in enumerate(part.signals)}
    renewed = list[Fit]()
    for each in fits:
        recorded = quiet.get(each, each.recorded)
        reads = {identifier_of(signal) for part in recorded.parts for signal in part.read} & set(given)
        # Of a part without states, what it leaves tells only the noise of its signal and of its inputs together.
        parts = tuple(_hear(part, given) if part.block.states else part for part in recorded.parts)
        if each in quiet:
            parts = tuple(_quieten(part, each) for part in parts)
        recorded = explain(replace(recorded, parts=parts), explained)
        is_fitted = each in quiet or reads
        renewed.append(temper(each.again(recorded), settings) if is_fitted else replace(each, recorded=recorded))
    return renewed


def explain_signals(fitted: Fit, settings: EngineSettings) -> dict[str, np.ndarray]:
    """Return the signals (n, K) without noise that a fit explains, and smooth ones at samples that do not count."""
    explained = dict[str, np.ndarray]()
    for part in fitted.recorded.parts:
        if not part.block.states or is_unexplained(fitted.chi_square[part.name], settings):
            continue
        read = fitted.models[part.name].read(1)
        for place, signal in enumerate(part.signals):
            explained[signal], counted = read[:, place], part.counted[:, place]
            if not counted.all():
                smooth = refine(fitted.recorded.signals[signal], part.fine)
                within = np.where(counted[:, part.nearest], read[:, place], smooth[:, :part.instants])
                explained[signal] = np.concatenate([within, smooth[:, part.instants:]], axis=1)
    return explained


def _quieten(part: Part, fitted: Fit) -> Part:
    """Return a part whose measured inputs that no block gives are without the noise that it shows.

    Columns from an input with noise are biased, as the residual contains this as well. What is left of it beside its
    mean given the residual is independent of that (regression calibration: Carroll et al., Measurement Error in
    Nonlinear Models, 2006, chapter 4).
    """
    own = _list_own_inputs(part, fitted.recorded.machine)
    if not own:
        return part
    inputs, beyond, shown = dict(part.inputs), dict(part.beyond), estimate_input_noise(fitted.models[part.name], own)
    for name, noise in shown.items():
        read, noise = part.inputs[name][:, ::part.fine] + part.beyond[name], straighten(noise)
        inputs[name], beyond[name] = refine(read - noise, part.fine), noise
    return replace(part, inputs=inputs, beyond=beyond)


def _list_own_inputs(part: Part, machine: Machine) -> list[str]:
    """Return the measured inputs of a part that no block gives, by identifier: it alone tells of their noise."""
    own = {identifier_of(name) for name in machine.driving}
    return [name for name in part.noise if name in own and part.block.states]


def _hear(part: Part, given: Mapping[str, tuple[Noise, np.ndarray]]) -> Part:
    """Return a part whose measured inputs have the noise that the parts show which give them, by identifier."""
    heard = {name: given.get(name, (noise, part.input_loudness[:, place]))
             for place, (name, noise) in enumerate(part.noise.items())}
    return replace(part, noise={name: noise for name, (noise, _) in heard.items()}, input_loudness=np.stack(
        [loudness for _, loudness in heard.values()], axis=1) if heard else part.input_loudness)


def fit_bare(group: Recorded, state: State | None = None, variance: np.ndarray | None = None) -> Fit:
    """Fit a group of parts without laws, but with the errors of their curves."""
    curves = list_curves(group, {part.name: nominal_own_values(part) for part in group.parts if part.block.curves})
    return fit(group, {pair: candidate for pair, (candidate, _) in curves.items()},
               {pair: Prior(within, length=FINER) for pair, (_, within) in curves.items()}, state, variance)


def renew_noise(bare: Fit) -> Recorded:
    """Return the recordings with the noise of sensors that a fit leaves, and of measured inputs that no part explains.

    Of parts with disturbances, it leaves these as well.
    """
    return replace(bare.recorded, parts=tuple(
        estimate_disturbances(bare.models[part.name]) if part.disturbances else
        _renew_part(part, bare.models[part.name], bare.recorded) for part in bare.recorded.parts))


def _renew_part(part: Part, model: PartFit, recorded: Recorded) -> Part:
    """Return a part with the noise that its model leaves."""
    n, _, k = part.measured.shape
    loudness = np.stack([estimate_loudness(model.residual[:, place], part.counted[:, place])
                         for place in range(len(part.signals))], axis=1)[:, :, None]
    unknown = _list_own_inputs(part, recorded.machine)
    own = {identifier_of(name): Differences.of(values) for name, values in recorded.runs.signals.items()
           if identifier_of(name) in unknown}
    lags = LONGER if own else LAGS

    def carry(noise: Mapping[str, Noise]) -> np.ndarray:
        random = np.random.default_rng(0)
        drawn = model.carry({name: draw_noise(each, (n, k), random) for name, each in noise.items()})
        return np.asarray(drawn / loudness)

    every = carry(part.noise)
    others = carry({name: noise for name, noise in part.noise.items() if name not in own}) if own else every
    # States make the noise of inputs slow.
    left = SecondDifferences.of(model.residual / loudness, part.counted, lags, others,
                                every if part.noise and part.block.states else None)
    inputs = [(part.noise[name], Carried(shows, CORRELATIONS, np.array(
        [second_variances(carry({name: shows.noise(rho)}), part.counted, lags) for rho in CORRELATIONS.tolist()])))
        for name, shows in own.items()]
    sensors, estimated = estimate_residual_noise(left, part.sensors, inputs)
    whole = part.measured / loudness
    return replace(part, loudness=loudness[:, :, 0], noise={**part.noise, **dict(zip(own, estimated, strict=True))},
                   sensors=tuple(bound_noise(each, whole[:, place]) for place, each in enumerate(sensors)))


def _doubt(fits: Sequence[Fit], settings: EngineSettings) -> np.ndarray:
    """Return robust deviations (n,) of the runs, by chi-square of the parts and by parameters."""
    by_squares = [_deviate(_logarithm(chi), settings.least_spread) for each in fits for chi in each.chi_square.values()]
    by_parameters = [np.abs(_deviate(each.state.points, each.recorded.widest)).max(axis=1, initial=0.0)
                     for each in fits]
    return np.asarray(np.max([*by_squares, *by_parameters], axis=0))


def _logarithm(chi: np.ndarray) -> np.ndarray:
    return np.asarray(np.log(np.maximum(chi, _LEAST_CHI)))


def _deviate(values: np.ndarray, least: np.ndarray | float, usual: np.ndarray | None = None) -> np.ndarray:
    """Return deviations of values (n, ...) from their median in robust standard deviations of at least `least`.

    Median and deviation are those of `usual` values (m, ...), where these are others.
    """
    usual = values if usual is None else usual
    return np.asarray((values - np.median(usual, axis=0)) / np.maximum(least, from_median(usual)[1]))


def is_unexplained(chi: np.ndarray, settings: EngineSettings) -> bool:
    """Whether runs leave more than noise: by a share, and by standard errors over the runs.

    In the mean, to which a few runs may give much, or in its logarithm, from which very different runs take little.
    """
    least = 0.25 * settings.unexplained
    return any(left.mean() > settings.errors * np.sqrt(left.var(ddof=1) / len(left) + least**2)
               for left in (chi - 1, _logarithm(chi)))


def list_unexplained(fits: Sequence[Fit], settings: EngineSettings) -> tuple[str, ...]:
    """Return the names of the parts of fits that leave more than noise."""
    return tuple(name for each in fits for name, chi in each.chi_square.items() if is_unexplained(chi, settings))

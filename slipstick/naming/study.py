"""Naming: what recordings ask for beside the model of a bench, block by block.

Laws are added to valve, load, input, lock and full contact, then to the closing piston with all that was found.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.converter import Converter
from slipstick.blocks.sensor_noise import Noise, power
from slipstick.errors import InvalidValue
from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Pair
from slipstick.naming.closed import closed, lacks_pressure
from slipstick.naming.fit import BlockFit
from slipstick.naming.forward import forward
from slipstick.naming.measured import LawPoints, measure_laws
from slipstick.naming.parameters import clocks_of, converter_of, parameters_of
from slipstick.naming.released import find_beyond
from slipstick.naming.scene import Scene
from slipstick.naming.selection import Finding, is_unexplained
from slipstick.naming.set_aside import bare, foreign, implausible, outlying, own_noise
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import Start, begin, noise_left
from slipstick.numerics.threads import in_one_blas_thread
from slipstick.recordings import Recordings
from slipstick.recordings.fitness import require_no_copies, require_one_clock, require_samples
from slipstick.recordings.signals import open_blocks

_SAME = 0.2
"""Difference of the logarithm of power up to which a noise is the same: estimates are as good as that."""
_SMOOTHED = 10
"""Samples before lock-up in standard deviations of the kernel that smooths signals: of fewer it leaves nothing."""


@dataclass(frozen=True, eq=False)
class Naming:
    """What recordings ask for: `findings` block by block, and the engagements `set_aside`, numbered from 0.

    In the blocks `unexplained` something is missing that no pair explains. Engagements `outlying` in a block are far
    worse than the others there with all findings, and yet used. `chi_square` is the reduced chi-square of every block
    with its findings, 1 where nothing is left but noise. `measured` has the law of each pair as values with units.
    `parameters` (n,) of the engagements that are not set aside are relative to nominal, `clocks` are the delays of the
    signals' clocks in s, and `converter` is that of the bench with the errors of its curve. `beyond` has the mean
    change of each known parameter that is beyond what was known of it, and its standard error, relative to nominal.
    `noise` has standard deviation and autocorrelation of the noise of each signal. `seconds` is the time that it took.
    Where no block has the signals at both of its ends, there is nothing but the noise and the converter. Unless it
    `is_complete`, more was about to be asked, by which all of it may change.
    """

    findings: tuple[Finding, ...]
    set_aside: tuple[int, ...]
    unexplained: tuple[str, ...]
    outlying: dict[str, tuple[int, ...]]
    chi_square: dict[str, float]
    measured: dict[Pair, LawPoints]
    parameters: dict[str, np.ndarray]
    clocks: dict[str, float]
    converter: Converter
    beyond: dict[str, tuple[float, float]]
    noise: dict[str, Noise]
    seconds: float
    is_complete: bool = True

    @property
    def lacking(self) -> tuple[str, ...]:
        """Blocks in which something is missing beside the findings, or where there are none in single engagements."""
        return self.unexplained or (() if self.findings else tuple(self.outlying))


@in_one_blas_thread
def name(bench: Bench, recordings: Recordings, settings: NamingSettings | None = None,
         ask: Ask = lambda _: None, keep: Callable[[Naming], None] | None = None) -> Naming:
    """Find what `recordings` of a `bench` ask for; raises `InvalidValue` as `scene_of` does.

    `keep` is called when the valve, and when all blocks but the closing piston have been examined, with what they ask
    for so far.
    """
    began, settings = time.perf_counter(), settings or NamingSettings()
    ask(Asked("engagements"))
    whole = scene_of(bench, recordings, settings)
    if not open_blocks(tuple(whole.smooth)):
        return Naming((), (), (), {}, {}, {}, {}, {}, bench.physics.curves, {}, whole.noise,
                      time.perf_counter() - began)
    plain = bare(whole)
    believed = np.flatnonzero(~foreign(whole, plain))
    kept = believed[~implausible(whole.take(believed), plain if len(believed) == len(whole) else ())]

    def summarize(now: _Linear, all_fits: Mapping[str, BlockFit], named: Sequence[Finding]) -> Naming:
        start = now.start
        return Naming((*start.findings, *named), tuple(np.setdiff1d(np.arange(len(whole)), now.kept).tolist()),
                      _find_unexplained(start, all_fits, settings), _find_outlying(now.kept, all_fits, settings),
                      {key: float(fit.chi2.mean()) for key, fit in all_fits.items()},
                      measure_laws(all_fits), parameters_of(all_fits), clocks_of(all_fits),
                      converter_of(all_fits, bench.physics.curves), find_beyond(all_fits, settings), start.noise,
                      time.perf_counter() - began)

    def keep_part(now: _Linear) -> None:
        if keep is not None:
            keep(replace(summarize(now, now.all_fits, now.findings), is_complete=False))

    def keep_valve(start: Start) -> None:
        keep_part(_Linear(kept, start, {}, []))

    start = begin(whole.take(kept), ask, keep=keep_valve)
    now = _Linear(kept, start, *_add_laws(start, settings, ask))
    keep_part(now)
    # What laws explain is no error of a recording, and was no noise.
    most = int(settings.most_outlying * len(believed)) - (len(believed) - len(kept))
    bad = outlying([fit.chi2 for fit in now.all_fits.values()] + start.chi_squares[len(now.fits):], settings)[:most]
    noise = noise_left(start, now.fits)
    if len(bad) or _differ(noise, start.noise):
        now = now.again(whole, bad, noise, settings, ask)
    all_fits, named = _add_piston(now, settings, ask)
    odd = outlying([all_fits["clutch"].chi2] if "clutch" in all_fits else [], settings)
    if 0 < len(odd) <= most - len(bad):
        now = now.again(whole, odd, now.start.noise, settings, ask)
        all_fits, named = _add_piston(now, settings, ask)
    return summarize(now, all_fits, named)


class _Linear(NamedTuple):
    """The blocks without the closing piston, for the engagements `kept`: their `start`, fits with laws, and findings.
    """

    kept: np.ndarray
    start: Start
    fits: dict[str, BlockFit]
    findings: list[Finding]

    @property
    def all_fits(self) -> dict[str, BlockFit]:
        """The fits of all these blocks, with their laws."""
        return dict(self.fits) if self.start.valve is None else {"valve": self.start.valve[1], **self.fits}

    def again(self, whole: Scene, bad: np.ndarray, noise: Mapping[str, Noise], settings: NamingSettings,
              ask: Ask) -> "_Linear":
        """Without the engagements `bad`, counted among those that were kept, and with this noise; of the `whole` scene.
        """
        known, kept = None, np.delete(self.kept, bad)
        if self.start.closing is not None:  # the onset is tried as well
            known = self.start.closing.known.without(bad)
        start = begin(replace(whole.take(kept), noise=dict(noise), noise_is_known=True), ask, known)
        return _Linear(kept, start, *_add_laws(start, settings, ask))


def _add_laws(start: Start, settings: NamingSettings, ask: Ask) -> tuple[dict[str, BlockFit], list[Finding]]:
    """The blocks behind the valve with their laws: an error of the pressure would look like laws of full contact."""
    return forward(start.fits, settings, ask, closed=("contact",) if lacks_pressure(start, settings) else ())


def _add_piston(now: _Linear, settings: NamingSettings, ask: Ask) -> tuple[dict[str, BlockFit], list[Finding]]:
    """All blocks with their laws, and the findings behind the valve, where the piston is asked as well."""
    all_fits = now.all_fits
    if now.start.closing is None:
        return all_fits, now.findings
    clutch, findings = closed(now.start, now.fits, now.findings, settings, ask)
    return {**all_fits, "clutch": clutch}, findings


def _find_unexplained(start: Start, all_fits: Mapping[str, BlockFit], settings: NamingSettings) -> tuple[str, ...]:
    """The blocks that `all_fits` does not explain."""
    before = {key: fit.chi2 for key, fit in start.fits.items()}
    if start.valve is not None:
        before["valve"] = start.valve[0].chi2
    if start.closing is not None:
        before["clutch"] = before["contact"]
    return tuple(key for key, fit in _drop_contact(all_fits).items()
                 if is_unexplained(fit.chi2, before[key], settings))


def _drop_contact(all_fits: Mapping[str, BlockFit]) -> dict[str, BlockFit]:
    """All blocks but full contact, which the clutch holds, with a better piston."""
    return {key: fit for key, fit in all_fits.items() if key != "contact"}


def _find_outlying(kept: np.ndarray, all_fits: Mapping[str, BlockFit],
                   settings: NamingSettings) -> dict[str, tuple[int, ...]]:
    """Those of the engagements `kept` that are far worse than the others in a block, the worst first, by block.

    More noise of the sensors in an engagement does not count.
    """
    explaining = _drop_contact(all_fits)
    noise = own_noise(next(iter(explaining.values())).block.scene)  # all blocks have the same recordings
    worst = {key: outlying([fit.chi2 / noise], settings) for key, fit in explaining.items()}
    return {key: tuple(kept[rows].tolist()) for key, rows in worst.items() if len(rows)}


def _differ(noise: Mapping[str, Noise], other: Mapping[str, Noise]) -> bool:
    """Whether the power of a noise differs from the other one by so much that laws may be other ones as well."""
    return any(abs(np.log(power(noise[name]) / power(other[name]))) > _SAME for name in noise)


def scene_of(bench: Bench, recordings: Recordings, settings: NamingSettings) -> Scene:
    """The scene of recordings that can be studied.

    Raises `InvalidValue` with too few engagements or samples, samples that are not equidistant, copies of engagements,
    and for a signal without noise.
    """
    if len(recordings) < settings.fewest:
        raise InvalidValue(f"{len(recordings)} engagements are too few to tell laws apart",
                           f"Record at least {settings.fewest} engagements under different conditions")
    if recordings.signals is not None:
        require_one_clock(recordings)
        require_samples(recordings, int(_SMOOTHED * settings.smoothing))
        require_no_copies(recordings.signals)
    return Scene.of(bench, recordings, settings)

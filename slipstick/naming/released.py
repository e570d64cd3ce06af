"""Parameters that a data sheet gives, and that are not what it says: the plainer explanation, which a law must beat.

A parameter that is off changes its block as a law would. A law is therefore compared with the fit of the same blocks in
which these parameters are as free as those that are calibrated.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from slipstick.bench.parameters import PARAMETERS, index
from slipstick.engine.linear_model import REACH
from slipstick.naming.answer import next_best
from slipstick.naming.block import Block, changed
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import BlockFit
from slipstick.naming.full_fits import refitted, rise_of, sharing
from slipstick.naming.mechanics import KNOWN
from slipstick.naming.restarts import evidence_of
from slipstick.naming.selection import Finding, Rival, in_errors, is_enough, is_unexplained, leads, priced
from slipstick.naming.settings import NamingSettings

AnyBlock = TypeVar("AnyBlock", bound=Block)
VALUE = "value"
"""What a parameter itself is said to be off by, in the place of what a law depends on."""


@dataclass(frozen=True, eq=False)
class Released:
    """The fits of blocks with free parameters, and their priced `rise` (n,) in the likelihood."""

    fits: Mapping[str, BlockFit]
    rise: np.ndarray

    def as_rival(self, finding: Finding) -> Rival:
        """The parameter that is furthest from what was known of it, as a rival of a finding."""
        changes = {name: abs(fit.fitted.coefficients[place]) for fit in self.fits.values()
                   for name, place in _list_freed(fit.block)}
        quantity = PARAMETERS[index(max(changes, key=changes.__getitem__))].meaning
        return Rival((quantity, VALUE), float(self.rise.sum()), in_errors(finding.gain - self.rise))


def release(fits: Mapping[str, BlockFit], blocks: Sequence[str]) -> Released | None:
    """The fits of these blocks with free parameters in the place of known ones; None where they have no known ones."""
    together = {name: fits[name] for name in sharing(fits, blocks)}
    count = sum(len(_list_known(fit.block)) for fit in together.values())
    if not count:
        return None
    starts = {name: replace(fit, block=_freed(fit.block)) for name, fit in together.items()}
    freed = refitted(starts, {name: fit.laws for name, fit in together.items()})
    return Released(freed, _priced(rise_of(fits, freed), count))


def release_piston(now: CurvedFit, other: CurvedFit) -> Released:
    """The same of the closing piston, from its fit and from an `other` one, which has further laws."""
    block, coefficients = _freed(now.block), {law: other.coefficients[law] for law in now.laws}
    freed = max(fit_curved(block, now.laws, start=now),
                fit_curved(block, now.laws, points=other.points, coefficients=coefficients, shared=other.shared),
                key=evidence_of)
    return Released({block.name: freed}, _priced(freed.evidence - now.evidence, len(_list_known(now.block))))


def contest(finding: Finding, released: Released, settings: NamingSettings) -> Finding | None:
    """The finding, or None where the values of parameters lead it, and explain their blocks.

    What leaves something unexplained is no explanation: parameters then go where what is missing pushes them.
    """
    explained = not any(is_unexplained(fit.chi2, fit.chi2, settings) for fit in released.fits.values())
    return None if explained and leads(released.rise, finding.gain, settings) else tie(finding, released, settings)


def tie(finding: Finding, released: Released, settings: NamingSettings) -> Finding:
    """The finding, with a parameter as a rival where it does not lead the values of parameters."""
    if leads(finding.gain, released.rise, settings):
        return finding
    rival = released.as_rival(finding)
    others = [rival] if finding.next_best is None else [finding.next_best, rival]
    return replace(finding, rivals=(*finding.rivals, rival), next_best=next_best(finding.pair, others))


def correct(fits: Mapping[str, BlockFit], settings: NamingSettings) -> dict[str, BlockFit]:
    """The fits with free parameters where a known one is beyond what was known, and the likelihood rises enough."""
    corrected = dict(fits)
    for names in dict.fromkeys(tuple(sharing(fits, [name])) for name in fits):  # those that share a law at once
        released = release(corrected, names)
        if released is not None and is_enough(released.rise, settings) and find_beyond(released.fits, settings):
            corrected |= released.fits
    return corrected


def find_beyond(fits: Mapping[str, BlockFit], settings: NamingSettings) -> dict[str, tuple[float, float]]:
    """Change of each parameter that is beyond what was known of it, relative to nominal, and its standard error.

    Parameters of blocks that are not explained are not known, nor those that a fit has to hold.
    """
    beyond = dict[str, tuple[float, float]]()
    for fit in fits.values():
        errors, held = np.sqrt(np.diag(fit.fitted.covariance)), fit.fitted.held
        for name, place in [] if is_unexplained(fit.chi2, fit.chi2, settings) else _list_freed(fit.block):
            change, error = float(fit.fitted.coefficients[place]), float(errors[place])
            if abs(change) > REACH * max(KNOWN, error) and not held[place]:
                beyond[name] = change, error
    return beyond


def _priced(rise: np.ndarray, count: int) -> np.ndarray:
    """A rise (n,) less the price of so many parameters, of which all engagements tell the same."""
    return priced(rise, np.full(len(rise), count / len(rise)))


def _list_freed(block: Block) -> list[tuple[str, int]]:
    return [(name, place) for place, name in enumerate(block.random) if name in block.freed]


def _list_known(block: Block) -> list[str]:
    return [name for name, std in zip(block.random, block.random_std, strict=True) if std == KNOWN]


def _freed(block: AnyBlock) -> AnyBlock:
    """The block with its known parameters as free as those that are calibrated."""
    return changed(block, random_std=np.where(block.random_std == KNOWN, np.inf, block.random_std),
                   freed=(*block.freed, *_list_known(block)))

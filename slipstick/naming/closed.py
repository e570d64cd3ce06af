"""The closing piston with the laws that were found in full contact, and what it asks for itself."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Pair, changed
from slipstick.naming.closing import closing, followed
from slipstick.naming.contact import OnsetBlock
from slipstick.naming.curved import CurvedFit
from slipstick.naming.fit import BlockFit
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, is_unexplained, priced
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import Start
from slipstick.naming.torque_lag import gained_elsewhere
from slipstick.numerics.threads import mapped


def lacks_pressure(start: Start, settings: NamingSettings) -> bool:
    """Whether the valve is not explained with its laws."""
    if start.valve is None:
        return False
    bare, with_laws = start.valve
    return is_unexplained(with_laws.chi2, bare.chi2, settings)


def closed(start: Start, fits: Mapping[str, BlockFit], findings: list[Finding], settings: NamingSettings,
           ask: Ask) -> tuple[CurvedFit, list[Finding]]:
    """The closing piston with the laws of full contact, and all `findings` with what it asks for itself."""
    assert start.closing is not None
    ask(Asked("clutch", ("clutch",)))
    contact = fits["contact"]
    block = changed(start.closing.with_explained_speeds(fits), fine=contact.block.fine, finer=contact.block.finer)
    places = [start.closing.onset.points, *_searched(block, contact)]
    clutch = _settled(block, contact, places, contact.laws)
    alone, without = {finding.pair for finding in findings if finding.blocks == ("contact",)}, None
    if alone and is_unexplained(clutch.chi2, clutch.chi2, settings):
        without = _settled(block, contact, places[:1], [law for law in contact.laws if law not in alone])
        if evidence_of(without) > evidence_of(clutch):  # the closing plates contradict what full contact suggests
            clutch, findings = without, [finding for finding in findings if finding.pair not in alone]
        else:
            least = settings.further * (evidence_of(clutch) - evidence_of(without))
            clutch = followed(clutch, settings, least)
    if lacks_pressure(start, settings):  # the piston integrates the error of the pressure
        return clutch, findings
    in_contact = [finding for finding in findings if "contact" in finding.blocks]

    def ask_of(begun: CurvedFit, named: Sequence[Finding]) -> tuple[CurvedFit, list[Finding]]:
        return closing(begun, settings, ask, named, lambda fit: gained_elsewhere(fit, fits))

    clutch, clutch_findings = ask_of(clutch, in_contact)
    alone = {finding.pair for finding in in_contact if finding.blocks == ("contact",)}
    if alone and is_unexplained(clutch.chi2, clutch.chi2, settings):
        # Plates that meet where no law lets them show in full contact as laws of the friction, beside which none of the
        # piston is found. Without them, the clutch may name what it lacks.
        if without is None:
            without = _settled(block, contact, places[:1], [law for law in contact.laws if law not in alone])
        again, others = ask_of(without, [finding for finding in in_contact if finding.pair not in alone])
        if not is_unexplained(again.chi2, again.chi2, settings) and _worth(again) > _worth(clutch):
            clutch, clutch_findings = again, others
    return clutch, [*(finding for finding in findings if finding not in in_contact), *clutch_findings]


def _worth(fit: CurvedFit) -> float:
    """Evidence in nats less the price of the laws."""
    return float(priced(fit.evidence, np.sum([fit.leverage(law) for law in fit.laws], axis=0)).sum())


def _searched(block: ClutchBlock, contact: BlockFit) -> list[np.ndarray]:
    """Points (n, q) of the onset that are searched with the laws of full contact, if it has any."""
    if not contact.laws:
        return []
    window = OnsetBlock(block.scene, block.pressure, block.late, laws=contact.held, finer=block.finer)
    return [search(changed(window, fine=block.fine, in_contact=block.in_contact), contact.shared[:1], contact.held)]


def _settled(block: ClutchBlock, contact: BlockFit, places: Sequence[np.ndarray], laws: Sequence[Pair]) -> CurvedFit:
    """The best fit with these laws from several points (n, q), with the friction coefficients of full contact."""
    starts = [np.concatenate([contact.points[:, :1], points[:, 1:]], axis=1) for points in places]
    return max(mapped(lambda points: settled(block, points, contact.shared[:1], tuple(laws), contact.coefficients),
                      starts), key=evidence_of)

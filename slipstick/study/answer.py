"""What a finished study answers, in JSON and in a sentence."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from slipstick.clutch import effects
from slipstick.clutch.effects.open_terms import SIGNALS
from slipstick.study.climb import Limits
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import Ranked

BLOCKS = {"pressure": "pressure", "output_torque": "torque", "output_speed": "output speed",
          "input_speed": "input speed"}
"""Signal that shows a block of the model -> the block."""
_CHOSEN = 0.05
"""Share of halves of the experiments that must choose a form for it to be told."""


def left_over(comparison: Comparison, found: MixedFit) -> dict[str, Any]:
    """The signal that a fit leaves most of, and how much: RMS in units of its noise."""
    levels = dict(zip(comparison.channels, np.sqrt(found.state.noise).tolist(), strict=True))
    signal = max((name for name in levels if name != "shifting_time"), key=lambda name: levels[name])
    return {"signal": signal.replace("_", " "), "noise_levels": levels[signal]}


def covariance(found: MixedFit) -> np.ndarray:
    """Of theta, (p, p): sandwich estimator over experiments, each of which is one observation."""
    integrated, limits = found.marginal, Limits.of(found.design)
    bread = np.linalg.pinv(integrated.information.sum(axis=0) + np.diag(limits.precision), hermitian=True)
    score = integrated.score
    return np.asarray(bread @ (score.T @ score) @ bread)


def coefficients(found: MixedFit, level: float) -> list[dict[str, Any]]:
    """The coefficients of the added effects in their units, with intervals of `level`."""
    deviation = np.sqrt(np.diag(covariance(found)))
    first, wide, listed = len(found.design.parameters), float(ndtri((1 + level) / 2)), []
    for place, (effect, one) in enumerate(found.design.coefficients, first):
        value, error = found.state.theta[place] * one.typical, wide * deviation[place] * abs(one.typical)
        listed.append({"effect": effect, "coefficient": one.name, "unit": one.unit, "value": float(value),
                       "lower": float(value - error), "upper": float(value + error),
                       "at_bound": bool(min(value - one.lower, one.upper - value) < 1e-3 * (one.upper - one.lower))})
    return listed


def placed(one: Ranked, level: float) -> dict[str, Any]:
    """A candidate's place in the ranking as JSON."""
    return {"effect": one.effect, "title": effects.find(one.effect).title, "block": effects.find(one.effect).block,
            "held_out_gain": float(one.gain.mean()), "error": float(one.gain.std(ddof=1) / np.sqrt(len(one.gain))),
            "sure": one.sure, "behind": one.behind, "tied": one.tied,
            "bootstrap_share": one.share, "bic": one.bic, "rise": one.rise, "converged": one.found.converged,
            "noise": np.sqrt(one.found.state.noise).tolist(), "coefficients": coefficients(one.found, level)}


def names(added: list[str]) -> str:
    """The titles of effects as a phrase."""
    return " and ".join(effects.find(name).title for name in added)


def term(found: list[dict[str, Any]]) -> str:
    """An open term in words of mathematics, from its coefficients."""
    size, signal, power = (one["value"] for one in found)
    unit = "" if found[0]["unit"] == "1" else f" {found[0]['unit']}"
    return f"{size:.2g}{unit} {form(signal, power)}"


def forms(screening: dict[str, Any]) -> list[dict[str, Any]]:
    """The forms of open terms that halves of the experiments choose, the most often chosen first."""
    chosen = sorted(screening["open"]["probes"], key=lambda one: -float(one["selected"]))
    return [{"quantity": effects.find(one["effect"]).quantity, "share": one["selected"],
             "form": form(one["shape"]["signal"], one["shape"]["power"])}
            for place, one in enumerate(chosen) if place == 0 or one["selected"] >= _CHOSEN]


def form(signal: float, power: float) -> str:
    """What an open term grows with."""
    name, reference = SIGNALS[round(signal)]
    return f"({name} / {reference})" + (f"^{power:.0f}" if power > 1.5 else "")

"""Print the catalogue of effects as Markdown: `python docs/effects.py > docs/effects.md`. A test compares the two."""

from collections.abc import Mapping
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.scales import SCALES
from slipstick.clutch.effects import CATALOGUE, Coefficient, Effect
from slipstick.clutch.effects.effect import BLOCKS, SENSORS

_HEAD = """# Catalogue of effects

The catalogue contains physical effects that the paper's model lacks. Each effect is one file in
`slipstick/clutch/effects/`; the sensor effects share one file. All effects are compiled into the simulator, and an
effect is absent unless a model names it. At the neutral coefficients the results are bit-identical to those of the
paper's model. A coefficient without a neutral value is a shape coefficient: it matters only if another coefficient of
the effect is not neutral.

A study finds an effect by the quantity, by what it depends on, and by the shape of the change over that.
[add_an_effect.md](add_an_effect.md) explains these words and how to add an effect. The symbols in the formulas are
those of [nomenclature.md](nomenclature.md); `run` is the position in the run order.
`python docs/effects.py > docs/effects.md` generates this page.

The model is divided into blocks at the measured signals: from current to pressure, from pressure and speeds to torque,
and from torque to the output speed and to the input speed.
"""
_ON_BENCHES = """## Bounds and typical values

A study searches a coefficient between its bounds and begins in steps of its typical value. Both are multiples of what
is large on the bench at hand, its scales, so that they hold on any bench. Neutral values are absolute. The tables show
the multiples, what they are multiples of, and the values on the heavy bench ([heavy.toml](../tables/heavy.toml)).
"""
_HEAVY = Bench.open(Path(__file__).parents[1] / "tables" / "heavy.toml").scales
_COLUMNS = "coefficient | unit | meaning | neutral | typical | bounds | times | typical on heavy | bounds on heavy"


def page() -> str:
    """The page in Markdown."""
    blocks, sections = [_block_row(block) for block in BLOCKS], [_section(effect) for effect in CATALOGUE]
    scales = [f"| {_words(name)} | {unit} | {words} | {getattr(_HEAVY, name):.4g} |"
              for name, (unit, words) in SCALES.items()]
    return "\n".join([_HEAD, "| block | effects |", "| --- | --- |", *blocks, "", _ON_BENCHES,
                      "| scale | unit | meaning | on heavy |", "| --- | --- | --- | --- |", *scales, "", *sections])


def _words(scale: str) -> str:
    return scale.replace("_", " ")


def _product(scale: Mapping[str, int]) -> str:
    """A product of scales in words, such as pressure / speed^2."""
    over, under = ([_words(name) + (f"^{abs(power)}" if abs(power) > 1 else "") for name, power in scale.items()
                    if power * sign > 0] for sign in (1, -1))
    return " / ".join([" ".join(over) or "1", *under]) if scale else "-"


def _block_row(block: str) -> str:
    links = ", ".join(f"[{effect.name}](#{effect.name})" for effect in CATALOGUE if effect.block == block)
    return f"| {block} | {links} |"


def _section(effect: Effect) -> str:
    rows = [_coefficient_row(coefficient) for coefficient in effect.coefficients]
    quantity = f"reading of the {effect.quantity}" if effect.quantity in SENSORS else effect.quantity
    depends_on = f"{effect.depends_on}; the change {effect.shape.words}" if effect.shape else effect.depends_on
    also = "".join(f", {name} by {on}" for name, on in effect.also)
    return "\n".join([
        f"## {effect.name}", "",
        f"{effect.title}. Changes the {quantity} ({effect.unit}) to", "", f"    {effect.law}", "",
        f"| {_COLUMNS} |", "| --- | --- | --- | --- | --- | --- | --- | --- | --- |", *rows, "",
        f"- Depends on: {depends_on}.", *([f"- A study may also find it as: {also[2:]}."] if also else []),
        f"- On a test bench: {effect.signature}.", f"- Source: {effect.source}.", ""])


def _coefficient_row(c: Coefficient) -> str:
    neutral = "-" if c.shape else f"{c.neutral:g}"
    on = c.on(_HEAVY)
    return (f"| `{c.name}` | {c.unit} | {c.meaning} | {neutral} | {c.typical:g} | {c.lower:g} to {c.upper:g} | "
            f"{_product(c.scale)} | {on.typical:.3g} | {on.lower:.3g} to {on.upper:.3g} |")


if __name__ == "__main__":
    print(page(), end="")

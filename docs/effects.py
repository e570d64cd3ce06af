"""Print the catalogue of effects as Markdown: `python docs/effects.py > docs/effects.md`. A test compares the two."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.scales import SCALES
from slipstick.clutch.effects import CATALOGUE, Coefficient, Effect
from slipstick.clutch.effects.effect import BLOCKS, SENSORS

_HEAD = """# Catalogue of effects

The catalogue contains physical effects that the paper's model lacks, each a file in `slipstick/clutch/effects/` (those
of sensors share one). An effect is absent unless a model names it. At the neutral coefficients the results are
bit-identical to those of the paper's model. A shape coefficient has no neutral value: it matters only if another
coefficient of the effect is not neutral.

A study finds an effect by the quantity, by what it depends on, and by the shape of the change over that.
[add_an_effect.md](add_an_effect.md) explains these words and how to add an effect. The symbols in the formulas are
those of [nomenclature.md](nomenclature.md); `run` is the position in the run order.
`python docs/effects.py > docs/effects.md` generates this page.
"""
_ON_BENCHES = """## Bounds and typical values

A study searches a coefficient between its bounds and begins in steps of its typical value. Both are multiples of what
is large on the bench at hand, its scales, so that they hold on any bench; a product of scales stands after "times".
Neutral values are absolute. In brackets is the typical value on the heavy bench ([heavy.toml](../tables/heavy.toml)).
"""
_HEAVY = Bench.open(Path(__file__).parents[1] / "tables" / "heavy.toml").scales


def page() -> str:
    """The page in Markdown."""
    alike: dict[str, list[Effect]] = {}
    for effect in CATALOGUE:
        alike.setdefault(_heading(effect), []).append(effect)
    blocks, sections = [_block_row(block) for block in BLOCKS], [_section(name, of) for name, of in alike.items()]
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
    return " / ".join([" ".join(over) or "1", *under])


def _heading(effect: Effect) -> str:
    """The heading of an effect: an error of a sensor has one for all sensors."""
    return f"sensor_{effect.depends_on}" if effect.quantity in SENSORS else effect.name


def _block_row(block: str) -> str:
    links = ", ".join(f"[{effect.name}](#{_heading(effect)})" for effect in CATALOGUE if effect.block == block)
    return f"| {block} | {links} |"


def _section(heading: str, effects: Sequence[Effect]) -> str:
    """The section of an effect, or of an error that each sensor may have."""
    effect, is_sensor = effects[0], effects[0].quantity in SENSORS
    changed = "Changes a reading" if is_sensor else f"{effect.title}. Changes the {effect.quantity} ({effect.unit})"
    depends_on = f"{effect.depends_on}; the change {effect.shape.words}" if effect.shape else effect.depends_on
    also = "".join(f", {name} by {on}" for name, on in effect.also)
    return "\n".join([
        f"## {heading}", "", f"{changed} to", "", f"    {effect.law}", "",
        *(_item(each, coefficient) for each in effects for coefficient in each.coefficients),
        f"- Depends on: {depends_on}.", *([f"- A study may also find it as: {also[2:]}."] if also else []),
        f"- On a test bench: {effect.signature}.", f"- Source: {effect.source}.", ""])


def _item(effect: Effect, c: Coefficient) -> str:
    name = f"`{c.name}` of `{effect.name}`" if effect.quantity in SENSORS else f"`{c.name}`"
    neutral = "shape coefficient" if c.shape else f"neutral {c.neutral:g}"
    times = f", times {_product(c.scale)}" if c.scale else ""
    on_heavy = f" ({c.on(_HEAVY).typical:.3g})" if c.scale else ""
    return (f"- {name} ({c.unit}): {c.meaning}; {neutral}, typical {c.typical:g}{on_heavy}, "
            f"bounds {c.lower:g} to {c.upper:g}{times}.")


if __name__ == "__main__":
    print(page(), end="")

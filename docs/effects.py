"""Print the catalogue of effects as a page: `python docs/effects.py > docs/effects.md`; a test compares the two."""

from slipstick.clutch.effects import CATALOGUE, Coefficient, Effect
from slipstick.clutch.effects.effect import BLOCKS

_HEAD = """# Catalogue of effects

What the paper's model lacks, one file of `slipstick/clutch/effects/` each (those of sensors share one). All are
compiled in; an effect is absent unless a model names it. At the neutral coefficients results are bit-identical to the
paper's model; a coefficient without a neutral value shapes an effect that the others bring.
[add_an_effect.md](add_an_effect.md) says how to add one, and what the signals in the formulas are.
`python docs/effects.py > docs/effects.md` makes this page.

The blocks are the model cut at the signals that a bench measures: from the current to the pressure, from pressure and
speeds to the torque, from the torque to either speed.
"""
_LISTED = [effect for effect in CATALOGUE if effect.listed]
_COLUMNS = "coefficient | unit | meaning | neutral | typical | bounds"


def page() -> str:
    """The page in Markdown."""
    blocks, sections = [_members(block) for block in BLOCKS], [_section(effect) for effect in _LISTED]
    return "\n".join([_HEAD, "| block | effects |", "| --- | --- |", *blocks, "", *sections])


def _members(block: str) -> str:
    return f"| {block} | {', '.join(f'[{one.name}](#{one.name})' for one in _LISTED if one.block == block)} |"


def _section(effect: Effect) -> str:
    return "\n".join([
        f"## {effect.name}", "",
        f"{effect.title}. Changes the {effect.quantity} ({effect.unit}) to", "", f"    {effect.law}", "",
        f"| {_COLUMNS} |", "| --- | --- | --- | --- | --- | --- |", *(_row(one) for one in effect.coefficients), "",
        f"- What a bench shows: {effect.signature}.", f"- Source: {effect.source}.", ""])


def _row(one: Coefficient) -> str:
    neutral = "-" if one.shape else f"{one.neutral:g}"
    return (f"| `{one.name}` | {one.unit} | {one.meaning} | {neutral} | {one.typical:g} "
            f"| {one.lower:g} to {one.upper:g} |")


if __name__ == "__main__":
    print(page(), end="")

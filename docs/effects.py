"""Print the catalogue of effects as a page: `python docs/effects.py > docs/effects.md`; a test compares the two."""

from slipstick.clutch.effects import CATALOGUE, Effect
from slipstick.clutch.effects.effect import QUANTITIES

_HEAD = """# Catalogue of effects

What the paper's model lacks, one file of `slipstick/clutch/effects/` each. All are compiled in; an effect is absent
unless a model names it. At the neutral coefficients results are bit-identical to the paper's model; a coefficient
without a neutral value shapes an effect that the others bring.
[add_an_effect.md](add_an_effect.md) says how to add one. `python docs/effects.py > docs/effects.md` makes this page.
"""


def page() -> str:
    """The page in Markdown."""
    return "\n".join([_HEAD, *(_section(effect) for effect in CATALOGUE)])


def _section(effect: Effect) -> str:
    rows = [f"| `{c.name}` | {c.unit} | {c.meaning} | {'-' if c.shape else f'{c.neutral:g}'} | {c.typical:g} "
            f"| {c.lower:g} to {c.upper:g} |" for c in effect.coefficients]
    return "\n".join([
        f"## {effect.name}", "",
        f"{effect.title}, in the block of the {effect.block}. Changes the {effect.quantity} "
        f"({QUANTITIES[effect.quantity]}) to", "", f"    {effect.law}", "",
        "| coefficient | unit | meaning | neutral | typical | bounds |", "| --- | --- | --- | --- | --- | --- |", *rows,
        "", f"- What a bench shows: {effect.signature}.", f"- Source: {effect.source}.", ""])


if __name__ == "__main__":
    print(page(), end="")

"""Polynomial chaos expansions in standardised germs (section III.A, eqs. 5 and 6)."""

from slipstick.uncertainty.chaos.adaptive import Adapted, adapt
from slipstick.uncertainty.chaos.expansion import (
    ORDER,
    Basis,
    Expansion,
    ExpansionSettings,
    Rule,
    default_order,
    expand,
    make_basis,
)
from slipstick.uncertainty.chaos.families import FAMILIES, Family
from slipstick.uncertainty.chaos.germs import Germ, germs_from_normals
from slipstick.uncertainty.chaos.output import Output
from slipstick.uncertainty.chaos.sensitivity import first_order, total
from slipstick.uncertainty.chaos.truncation import HIGHEST_ORDER

__all__ = ["FAMILIES", "HIGHEST_ORDER", "ORDER", "Adapted", "Basis", "Expansion", "ExpansionSettings", "Family", "Germ",
           "Output", "Rule", "adapt", "default_order", "expand", "first_order", "germs_from_normals", "make_basis",
           "total"]

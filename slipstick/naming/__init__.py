"""Naming: which quantity of a bench depends on what, beyond its model, found block by block in recordings."""

from slipstick.naming.answer import Answer, answer
from slipstick.naming.measured import LawPoints
from slipstick.naming.settings import NamingSettings
from slipstick.naming.study import Naming, name

__all__ = ["Answer", "LawPoints", "Naming", "NamingSettings", "answer", "name"]

"""Parametric uncertainty (section III): normal inputs, polynomial chaos, likelihood and its maximum.

Knows one protocol, `model(points, conditions) -> shifting times`: a table, a surrogate and the simulator all
satisfy it.
"""

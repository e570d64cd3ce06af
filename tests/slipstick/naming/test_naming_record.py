"""A stored naming is the same naming again."""

import json

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.naming.record import from_json, to_json
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.study import Naming


def test_a_naming_is_stored_with_all_that_its_findings_state() -> None:
    rival = Rival(("load torque", "time"), 20.0, 1.5)
    gain, expected = np.array([3.0, -1.0, 8.0, 5.0] * 8), np.array([2.0, 0.5, 3.0, 2.5] * 8)
    one = Finding(("load", "lock"), ("output speed sensor", "lag"), gain, (rival,), rival, expected, 46.8)
    bare = Finding(("contact",), ("friction coefficient", "slip"), np.full(32, 4.0), rare=True)
    converter = Converter((0.0, 0.5, 1.0), (2.0, 1.5, 1.0), (10.0, 12.0, 20.0))
    found = Naming((one, bare), (3,), ("input",), {"load": (4, 17)}, {"load": 1.1}, {},
                   {"load_inertia": np.array([0.1, 0.2])},
                   {"pressure": 0.001}, converter, {"pressure": (0.1, 0.3)}, 4.5)
    again = from_json(json.loads(json.dumps(to_json(found))))
    assert json.dumps(to_json(again)) == json.dumps(to_json(found))
    for before, after in zip(found.findings, again.findings, strict=True):
        assert (after.pair, after.blocks) == (before.pair, before.blocks)
        assert after.rare == before.rare
        assert (after.errors, after.lead) == (before.errors, before.lead)
        assert (after.rivals == ()) == (before.rivals == ())
    assert again.findings[0].errors == 46.8  # more than the gains have

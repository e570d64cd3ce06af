"""Which recordings are those that are shipped, whatever their name: by the digest of their numbers."""

SIMULATED = frozenset({
    "afbc325749b2c58d6fa6cd726742dc82a0c47d5e98b609af0aae59ea450bbd87",  # measured
    "ef499c8a1763b44909c72a100a1d25011bc1b04804960db562cdb6555f303e18",  # measured-compact
    "fbb6753d64a84f1fd37e74fe93e8b922ce24b8dbf0b1aafc60ce6b77ecba7f6a",  # sample
})
"""Digests of the shipped recordings, all of which an independent simulation of a test bench made."""

"""Other methods on the recordings that the engine answers: a regression of residuals, and SINDy with the known terms.

    python -m evidence.peers --seed 7001 --cases 24

Both know what the engine knows: the declared machine, its nominal numbers, and the candidates of the engine. Both are
answered from the same columns (`equations`), and are judged as the engine is.
"""

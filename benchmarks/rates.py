"""Bounds of a rate."""

from scipy.stats import beta


def bounds(hits: int, n: int) -> tuple[float, float]:
    """The 95 % bounds of the rate of `hits` of n (Clopper and Pearson)."""
    return (float(beta.ppf(0.025, hits, n - hits + 1)) if hits else 0.0,
            float(beta.ppf(0.975, hits + 1, n - hits)) if hits < n else 1.0)

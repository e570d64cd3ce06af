"""The expansion of order 8 of two normal inputs by chaospy, OpenTURNS and numpy, from the same times at the nodes."""

import chaospy
import numpy as np
import openturns

from slipstick.uncertainty.chaos import ExpansionSettings, expand, make_basis
from slipstick.uncertainty.chaos.families import HERMITE

ORDER = 8
BASIS = make_basis((HERMITE, HERMITE), ExpansionSettings(ORDER, checks=0))


class Peers:
    """Projection of the times at the nodes (81, n), and values at germs (m, 2); bases and rules are made in advance."""

    def __init__(self, times: np.ndarray, germs: np.ndarray) -> None:
        self.times, self.germs = times, germs
        self.values_of_basis = BASIS.at(germs)
        normal = chaospy.J(chaospy.Normal(0, 1), chaospy.Normal(0, 1))
        self.chaospy_basis = chaospy.generate_expansion(ORDER, normal, normed=True)
        # The weights of the rule follow from the row of the constant polynomial, whose projection is the mean.
        self.weights = BASIS.projection[0]
        self.distribution = openturns.JointDistribution([openturns.Normal(0, 1)] * 2)
        hermite = openturns.StandardDistributionPolynomialFactory(openturns.Normal(0, 1))
        product = openturns.OrthogonalProductPolynomialFactory([hermite] * 2, openturns.LinearEnumerateFunction(2))
        self.strategy = openturns.FixedStrategy(product, len(BASIS.degrees))
        self.samples = openturns.Sample(BASIS.nodes), openturns.Point(self.weights), openturns.Sample(germs)

    def ours(self) -> np.ndarray:
        """This project."""
        return expand(BASIS, self.times).at(self.germs)

    def numpy(self) -> np.ndarray:
        """Two matrix products; the basis at the germs is computed in advance."""
        return self.values_of_basis @ (BASIS.projection @ self.times)

    def chaospy(self) -> np.ndarray:
        """`fit_quadrature` and a call of the polynomials."""
        fitted = chaospy.fit_quadrature(self.chaospy_basis, BASIS.nodes.T, self.weights, self.times)
        return np.asarray(fitted(*self.germs.T)).T

    def openturns(self) -> np.ndarray:
        """`FunctionalChaosAlgorithm` with the weights of the rule, and a call of the metamodel."""
        nodes, weights, germs = self.samples
        algorithm = openturns.FunctionalChaosAlgorithm(
            nodes, weights, openturns.Sample(self.times), self.distribution, self.strategy,
            openturns.IntegrationStrategy())
        algorithm.run()
        return np.array(algorithm.getResult().getMetaModel()(germs))

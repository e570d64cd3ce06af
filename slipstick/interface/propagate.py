"""`slipstick.propagate`: the distributions of an output that follow from those of the inputs of a table."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from slipstick.errors import InvalidValue, require_whole, within_memory
from slipstick.inference.inputs import table_inputs
from slipstick.inference.problems import table_model
from slipstick.inference.propagation import (
    QUANTILES,
    Distributions,
    PropagationSettings,
    compute_distributions,
    default_output_std,
    expand_outputs,
    select_conditions,
)
from slipstick.interface.files import require_html, write
from slipstick.interface.models import in_unit_of
from slipstick.interface.tables import (
    TableAnswer,
    TableLike,
    axes_of,
    condition_columns,
    descriptions,
    inputs_of,
    list_finite,
    numbers,
    open_table,
    require_outside,
    table_name,
)
from slipstick.pictures import propagation as picture
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec
from slipstick.report.propagation import (
    expansions_text,
    headline,
    inputs_text,
    propagation_page,
    propagation_text,
    warnings,
)
from slipstick.table import Outside, Table
from slipstick.table.subject import columns
from slipstick.uncertainty.chaos import ExpansionSettings, Family, Rule
from slipstick.uncertainty.likelihood import SAMPLES

DENSITY_POINTS = 161
"""Default number of points of a density; a picture needs as many."""


@dataclass(frozen=True, eq=False, repr=False)
class Propagation(TableAnswer):
    """Distributions of an output in n conditions for d uncertain inputs; NaN where a condition has none.

    `answer` has all of it as JSON, as the REST service gives it, and `request` says what was asked for. `output` is the
    name and unit of the output, s for shifting times: that of means, standard deviations, errors, quantiles and
    coefficients. `condition_columns` are the conditions in the order of the arrays.
    """

    kind: ClassVar[str] = "propagation"
    entries: ClassVar[tuple[str, ...]] = (
        "table", "table_digest", "axes", "outside", "mass_outside", "order", "nodes", "reached", "germs",
        "degrees", "conditions")

    @property
    def conditions(self) -> np.ndarray:
        """Indices (n,) of the conditions in the table."""
        return np.array(self._read_column("condition"))

    @property
    def mean(self) -> np.ndarray:
        """Means (n,)."""
        return numbers(self._read_column("mean"))

    @property
    def std(self) -> np.ndarray:
        """Standard deviations (n,) with the output noise."""
        return numbers(self._read_column("std"))

    @property
    def error(self) -> np.ndarray:
        """Estimated RMS errors (n,) of the expansions over the inputs."""
        return numbers(self._read_column("error"))

    @property
    def first_order(self) -> np.ndarray | None:
        """First-order Sobol indices (n, d), for the variance without output noise; None for dependent inputs."""
        return self._optional("first_order")

    @property
    def total(self) -> np.ndarray | None:
        """Total Sobol indices (n, d), for the variance without output noise; None for dependent inputs."""
        return self._optional("total")

    @property
    def probabilities(self) -> np.ndarray:
        """Probabilities (q,) of the quantiles."""
        return np.array(self.request["quantiles"])

    @property
    def quantiles(self) -> np.ndarray:
        """Quantiles (n, q) with the output noise."""
        return numbers(self._read_column("quantiles"))

    @property
    def density_time(self) -> np.ndarray | None:
        """Outputs (n, g) at which the densities are given; None without densities."""
        return self._optional("density_time")

    @property
    def density(self) -> np.ndarray | None:
        """Densities (n, g) with the output noise, per ms or thousandth of another unit; None without densities."""
        return self._optional("density")

    @property
    def coefficients(self) -> np.ndarray | None:
        """Coefficients (n, t) of the expansions; None unless they were asked for."""
        return self._optional("coefficients")

    @property
    def degrees(self) -> np.ndarray | None:
        """Degrees (t, d) of the terms in the germ of each input; None unless the coefficients were asked for."""
        return None if self.answer["degrees"] is None else np.array(self.answer["degrees"])

    @property
    def order(self) -> int:
        """Order of the expansions."""
        return int(self.answer["order"])

    @property
    def runs(self) -> int:
        """Number of model runs for each condition, of all orders that were tried."""
        return int(self.answer["nodes"])

    @property
    def reached(self) -> bool | None:
        """Whether the estimated error is within the tolerance; None without one."""
        reached: bool | None = self.answer["reached"]
        return reached

    @property
    def mass_outside(self) -> float:
        """Probability that the inputs lie outside the table."""
        return float(self.answer["mass_outside"])

    @property
    def columns(self) -> dict[str, list[Any]]:
        """Heading with unit -> a value for each condition, None where it has none; without densities."""
        rows, unit = self.answer["conditions"], self.output["unit"]
        table: dict[str, list[Any]] = {"condition": self._read_column("condition")}
        table |= {name: list(column) for name, column in condition_columns(self.condition_columns).items()}
        table |= {f"{name} [{unit}]": self._read_column(name) for name in ("mean", "std", "error")}
        table |= {f"quantile {probability:g} [{unit}]": [row["quantiles"][place] for row in rows]
                  for place, probability in enumerate(self.request["quantiles"])}
        table |= {f"{name} of {axis}": [row[name] and row[name][place] for row in rows]
                  for name in ("first_order", "total") for place, axis in enumerate(self.inputs)}
        return {**table, "reason": self._read_column("reason")}

    def summary(self) -> list[str]:
        """What was propagated to what, how far outputs scatter, the inputs, the error, and what limits the result."""
        drawn = self._drawn
        return [f"{headline(drawn)}. {picture.summarize(drawn)}.", inputs_text(drawn, self.request),
                expansions_text(drawn),
                *(" ".join(parts) for parts in warnings(drawn, self.request))]

    @property
    def text(self) -> str:
        """The summary and a table of the first conditions as plain text."""
        return propagation_text(self._drawn, self.request, self.condition_columns)

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """Density, quantiles and Sobol indices of the conditions, of many the first ones."""
        spec = picture.draw(self._drawn, self.request["quantiles"], self.condition_columns)
        return {"propagation": (spec, spec["description"])}

    def report(self, path: Path | str) -> Path:
        """Write the report as one HTML page, which needs no network and no scripts, and return its path.

        Raises `InvalidValue` for a path that does not end in `.html`, or where the extra `reports` is not installed.
        """
        require_html(path)
        return write(path, propagation_page(self._drawn, self.request, self.condition_columns).encode())

    @property
    def _drawn(self) -> dict[str, Any]:
        """The answer as pictures and pages take it."""
        return {**self.answer, "output": self.output}

    def _read_column(self, name: str) -> list[Any]:
        return [row[name] for row in self.answer["conditions"]]

    def _optional(self, name: str) -> np.ndarray | None:
        rows = self._read_column(name)
        return None if rows[0] is None else numbers(rows)


@within_memory()
def propagate(table: TableLike, mean: float | Sequence[float] | np.ndarray,
              std: float | Sequence[float] | np.ndarray | None = None, *,
              families: Family | Sequence[Family] | None = None,
              mixing: Sequence[Sequence[float]] | np.ndarray | None = None,
              correlation: Sequence[Sequence[float]] | np.ndarray | None = None,
              support: Sequence[Sequence[float]] | np.ndarray | None = None, output_std: float | str | None = None,
              conditions: Sequence[int] | None = None, order: int | None = None, norm: float = 1.0,
              rule: Rule | None = None, nodes: int | None = None, runs: int | None = None,
              tolerance: float | str | None = None, quantiles: Sequence[float] = QUANTILES,
              density_points: int = DENSITY_POINTS, samples: int = SAMPLES, seed: int = 1, outside: Outside = "clip",
              coefficients: bool = False, name: str | None = None) -> Propagation:
    """Compute the distribution of the output in each condition by polynomial chaos expansion.

    Parameters
    ----------
    table : Table, Path or str
        The table, a grid or a surrogate, or the path of its file.
    mean : float or sequence
        Mean of the input of each axis, in multiples of its nominal value.
    std : float or sequence, optional
        Standard deviation of each input, in multiples of its nominal value. Either `std` or `mixing` is required.
    families : str or sequence of str, optional
        Family of each input: "normal" (default), "lognormal", "gamma", "beta" or "uniform".
    mixing : matrix, optional
        The matrix L of normal inputs mean + L z with standard normals z; their covariance is L L^T.
    correlation : matrix, optional
        Correlation of the normal scores of the inputs, which is that of the inputs if these are normal.
    support : sequence of pairs, optional
        Range of each beta input; by default that of its axis.
    output_std : float, optional
        Standard deviation of the additive output noise in the unit of the output. By default 0.003 s for shifting
        times, and 0 for the output of another machine.
    conditions : sequence of int, optional
        Indices, from 0, of conditions of the table; by default all.
    order, norm : int and float
        Total degree of the expansion, by default 8, or less for more than five inputs; and exponent of its hyperbolic
        truncation: 1 keeps all terms up to the degree, smaller values drop interactions.
    rule : {"tensor", "regression"}, optional
        Where the table is evaluated: on a tensor grid of Gauss `nodes` per axis (by default order + 1), or at random
        points, `runs` in number (by default twice the number of terms). By default the grid for one or two inputs.
    tolerance : float, optional
        Error in the unit of the output, until which the order is raised from 1, or until 20,000 model runs are used.
    quantiles : sequence of float
        Probabilities of the quantiles, at least 1 / `samples` away from 0 and 1.
    density_points : int
        Number of points of each density, up to five standard deviations from the mean; 0 for none. There are none
        without output noise.
    samples, seed : int
        Number, a power of two, and seed of the samples of the expansion from which quantiles and densities follow.
    outside : {"clip", "nan", "error"}, optional
        What holds outside the table: the value at its nearest edge, no value, or an error.
    coefficients : bool
        Whether the result has the coefficients of the expansions.
    name : str, optional
        Name of the table in reports; by default that of its file.

    Returns
    -------
    Propagation

    Raises
    ------
    InvalidValue, UnknownName
        For inputs, conditions or settings that do not fit the table, or each other.
    OutsideTable
        If the table is evaluated outside its axes, and `outside` is "error".

    References
    ----------
    Tod et al., section III.A.

    """
    require_outside(outside)
    require_whole(order=order, nodes=nodes, runs=runs, density_points=density_points, samples=samples, seed=seed)
    opened = open_table(table)
    inputs = table_inputs(opened, mean, std, families, mixing, correlation, support)
    selected, rows = select_conditions(opened, conditions)
    unit = opened.output.unit
    noise = default_output_std(opened.model) if output_std is None else in_unit_of(output_std, unit, "output_std")
    limit = None if tolerance is None else in_unit_of(tolerance, unit, "tolerance")
    settings = PropagationSettings(
        noise, ExpansionSettings(order, norm, rule, nodes, samples=runs, seed=seed), limit, samples, seed,
        _probabilities(quantiles), density_points if noise else 0)
    expanded = expand_outputs(table_model(selected, outside), selected.conditions, inputs, settings)
    distributions = compute_distributions(expanded, inputs, opened.lower, opened.upper, settings)
    request = {"inputs": inputs_of(inputs), "output_std": noise, "conditions": rows, "outside": outside,
               "expansion": {"order": order, "norm": norm, "rule": rule, "nodes": nodes, "runs": runs},
               "tolerance": limit, "samples": samples, "seed": seed, "quantiles": list(settings.quantiles),
               "density_points": settings.density_points, "coefficients": coefficients}
    return present(opened, name or table_name(table), selected, rows, distributions, request)


def present(table: Table, name: str, selected: Table, rows: Sequence[int], distributions: Distributions,
            request: Mapping[str, Any]) -> Propagation:
    """The result for the conditions `rows` of a `table`, that `selected` has; `request` is that of the REST service."""
    reason = f"There are {picture.missing_runs(Output(table.output.name, table.output.unit), request['outside'])}"
    basis, words = distributions.adapted.expansion.basis, descriptions(table.conditions)
    answer = {
        "table": name, "table_digest": table.digest, "axes": axes_of(table), "outside": request["outside"],
        "mass_outside": distributions.mass_outside, "order": basis.order, "nodes": distributions.adapted.runs,
        "reached": distributions.reached, "germs": [germ.name for germ in basis.germs],
        "degrees": basis.degrees.tolist() if request["coefficients"] else None,
        "conditions": [{"described": words[row["condition"]], **row}
                       for row in _rows(distributions, rows, request["coefficients"], reason)]}
    return Propagation(answer, asdict(table.output), request, columns(selected.conditions))


def _probabilities(quantiles: Sequence[float]) -> tuple[float, ...]:
    try:
        return tuple(map(float, quantiles))
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"`quantiles` is {quantiles!r:.60}",
                           "Give a list of probabilities, such as [0.05, 0.95]") from error


def _rows(distributions: Distributions, conditions: Sequence[int], with_coefficients: bool,
          reason: str) -> list[dict[str, Any]]:
    expansion, n = distributions.adapted.expansion, len(conditions)
    listed = {name: [None] * n if (values := getattr(distributions, name)) is None else list_finite(values)
              for name in ("mean", "std", "error", "quantiles", "first_order", "total", "density_time", "density")}
    listed["coefficients"] = list_finite(expansion.coefficients.T) if with_coefficients else [None] * n
    return [{"condition": condition, "reason": reason if expansion.missing[place] else None,
             **{name: values[place] for name, values in listed.items()}} for place, condition in enumerate(conditions)]

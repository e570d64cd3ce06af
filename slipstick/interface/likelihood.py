"""`slipstick.likelihood`: how likely measured outputs are under distributions of the inputs of a table."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from slipstick.black_box import Measurements
from slipstick.errors import InvalidValue, require_whole, within_memory
from slipstick.inference.inputs import table_inputs
from slipstick.inference.likelihoods import Likelihoods, LikelihoodSettings, Method, compute_likelihoods
from slipstick.inference.problems import Measured, table_problem
from slipstick.interface.models import in_unit_of
from slipstick.interface.tables import (
    TableAnswer,
    TableLike,
    axes_of,
    condition_columns,
    descriptions,
    inputs_of,
    list_finite,
    measured_of,
    numbers,
    open_table,
    require_outside,
    table_name,
)
from slipstick.pictures.output import Output
from slipstick.pictures.theme import Spec
from slipstick.recordings import Recordings
from slipstick.report.propagation import inputs_text, outside_warning
from slipstick.report.words import number, signed
from slipstick.table import Outside, Table
from slipstick.table.subject import columns
from slipstick.uncertainty.chaos import ExpansionSettings, Family, Rule
from slipstick.uncertainty.likelihood import SAMPLES, Candidate
from slipstick.uncertainty.likelihood.line_rules import ACROSS


@dataclass(frozen=True, eq=False, repr=False)
class Likelihood(TableAnswer):
    """The likelihood of n measured outputs under one distribution of d uncertain inputs.

    `answer` has it as JSON, as the REST service gives it for one candidate, and `request` says what was asked for.
    `measured_time` (n,) are the measurements, in the unit of the `output`, which has its name as well: s for shifting
    times. `condition_columns` are their conditions.
    """

    kind: ClassVar[str] = "likelihood"
    entries: ClassVar[tuple[str, ...]] = (
        "table", "table_digest", "recordings", "recordings_digest", "axes", "outside", "described", "candidates")

    measured_time: Sequence[float]

    @property
    def log10_likelihood(self) -> float:
        """log10 of the likelihood: the sum of the `log10_density`; -inf for a likelihood of 0."""
        value = self._candidate["log10_likelihood"]
        return -math.inf if value is None else float(value)

    @property
    def error(self) -> float | None:
        """Error of the log10 likelihood in decades, to hold in 95 % of the cases; None where it is not known."""
        error: float | None = self._candidate["error"]
        return error

    @property
    def log10_density(self) -> np.ndarray:
        """log10 of the density (n,) of each measurement, per ms or thousandth of another unit; -inf for 0."""
        return numbers(self._candidate["per_condition"], -math.inf)

    @property
    def mass_outside(self) -> float:
        """Probability that the inputs lie outside the table."""
        return float(self._candidate["mass_outside"])

    @property
    def columns(self) -> dict[str, list[Any]]:
        """Heading with unit -> a value for each measurement, None for a density of 0."""
        table: dict[str, list[Any]] = {"condition": list(range(len(self.measured_time)))}
        table |= {name: list(column) for name, column in condition_columns(self.condition_columns).items()}
        return {**table, f"{self.output['name']} [{self.output['unit']}]": list(self.measured_time),
                "log10_density": self._candidate["per_condition"]}

    def summary(self) -> list[str]:
        """The log10 likelihood and its error, the inputs, the least likely measurement, and what limits the result."""
        shown, densities = Output.of({"output": self.output}), self.log10_density
        least = int(np.argmin(densities))
        least_likely = f"measurement {least} ({self.answer['described'][least]})"
        count = f"{len(densities)} measurement{'s' * (len(densities) > 1)}"
        what = (f"{count} of the {shown.words} in “{self.answer['recordings']}” on the table "
                f"“{self.answer['table']}”")
        if math.isinf(self.log10_likelihood):
            lines = [f"The likelihood of {what} is 0: at all relevant inputs, the model has no {shown.words} for "
                     f"{np.count_nonzero(np.isinf(densities))} of them, such as {least_likely}."]
        else:
            error = "" if self.error is None else f" with an error of {number(self.error)} decades"
            lines = [f"log10 likelihood {signed(self.log10_likelihood)}{error}: {what}, with densities per "
                     f"{shown.per}.",
                     f"Least likely: {least_likely}, with a log10 density of {signed(densities[least])}."]
        lines.insert(1, inputs_text({**self.answer, "output": self.output},
                                    {"inputs": self._asked, "output_std": self._asked["output_std"]}))
        return [*lines, *(" ".join(parts) for parts in outside_warning(
            self.mass_outside, self.answer["outside"], shown))]

    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """There are none."""
        return {}

    @property
    def _candidate(self) -> Mapping[str, Any]:
        candidate: Mapping[str, Any] = self.answer["candidates"][0]
        return candidate

    @property
    def _asked(self) -> Mapping[str, Any]:
        candidate: Mapping[str, Any] = self.request["candidates"][0]
        return candidate


@within_memory()
def likelihood(table: TableLike, recordings: Measured | Path | str, mean: float | Sequence[float] | np.ndarray,
               std: float | Sequence[float] | np.ndarray | None = None, output_std: float | str | None = None, *,
               families: Family | Sequence[Family] | None = None,
               mixing: Sequence[Sequence[float]] | np.ndarray | None = None,
               correlation: Sequence[Sequence[float]] | np.ndarray | None = None,
               support: Sequence[Sequence[float]] | np.ndarray | None = None, method: Method = "auto",
               outside: Outside = "clip", order: int | None = None, norm: float = 1.0, rule: Rule | None = None,
               nodes: int | None = None, runs: int | None = None, lines: int = ACROSS, samples: int = SAMPLES,
               seed: int = 1, name: str = "recordings") -> Likelihood:
    """Compute the likelihood of measured outputs under distributions of the inputs and the output noise.

    The density of a measurement is the expectation, over the inputs, of a normal density about the output of the table
    with the output noise. The inputs of different runs are independent, so the log10 densities are summed.

    Parameters
    ----------
    table : Table, Path or str
        The table, a grid or a surrogate, or the path of its file.
    recordings : Recordings, Measurements, str or Path
        The measured shifting times, or outputs of a black box, or the name or the path of a file with them.
    mean, std, families, mixing, correlation, support
        The distributions of the inputs, as in `slipstick.propagate`.
    output_std : float or str
        Standard deviation of the additive output noise in the unit of the output, s for shifting times, or a text such
        as "10 ms".
    method : {"auto", "exact", "expansion", "sampling"}
        What is integrated: the table itself, with an error below 0.05 decades ("auto") or along the given number of
        `lines` ("exact"), or the polynomial chaos expansion along `lines` ("expansion") or over `samples` ("sampling"),
        as in the paper, which is inaccurate for narrow noise and for inputs that are far from the recordings.
    outside : {"clip", "nan", "error"}, optional
        What holds outside the table: the value at its nearest edge, no value, or an error.
    order, norm, rule, nodes, runs
        The expansion, for "expansion" and "sampling", as in `slipstick.propagate`.
    lines : int
        Number of integration lines for three or more inputs, a power of two from 16 to 1024.
    samples, seed : int
        Number of samples, a power of two, and seed of samples, lines and the runs of a regression.
    name : str, optional
        Name of the recordings in reports.

    Returns
    -------
    Likelihood

    Raises
    ------
    InvalidValue, UnknownName
        For inputs, settings or recordings that do not fit the table, or each other, such as times in another unit.
    OutsideTable
        If the table is evaluated outside its axes, and `outside` is "error".

    References
    ----------
    Tod et al., section III.B, eq. 7.

    """
    require_outside(outside)
    require_whole(order=order, nodes=nodes, runs=runs, lines=lines, samples=samples, seed=seed)
    if output_std is None:
        raise InvalidValue("The output noise is not given",
                           "Give as `output_std` its standard deviation in the unit of the output, such as 0.01 s")
    opened = open_table(table)
    recordings = measured_of(recordings, opened)
    inputs = table_inputs(opened, mean, std, families, mixing, correlation, support)
    candidate = Candidate(inputs, in_unit_of(output_std, opened.output.unit, "output_std"))
    expansion = ExpansionSettings(order, norm, rule, nodes, 0, runs, seed)
    settings = LikelihoodSettings(method, expansion, lines, samples, seed)
    computed = compute_likelihoods(table_problem(opened, recordings, outside), opened.output, [candidate], settings)
    request = {"recordings": name, "candidates": [{**inputs_of(inputs), "output_std": candidate.output_std}],
               "method": method, "outside": outside,
               "expansion": {"order": order, "norm": norm, "rule": rule, "nodes": nodes, "runs": runs},
               "lines": lines, "samples": samples, "seed": seed, "per_condition": True}
    answer = answer_of(opened, table_name(table), recordings, computed, request)
    return Likelihood(answer, asdict(opened.output), request, columns(recordings.conditions),
                      recordings.measured_time.tolist())


def answer_of(table: Table, name: str, recordings: Recordings | Measurements, computed: Likelihoods,
              request: Mapping[str, Any]) -> dict[str, Any]:
    """The likelihoods as JSON, as the REST service gives them for a `request`; `name` is that of the table."""
    is_detailed = request["per_condition"]
    return {
        "table": name, "table_digest": table.digest, "recordings": request["recordings"],
        "recordings_digest": recordings.digest, "axes": axes_of(table), "outside": request["outside"],
        "described": list(descriptions(recordings.conditions)) if is_detailed else None,
        "candidates": [{"log10_likelihood": total, "error": error, "per_condition": densities, "mass_outside": mass}
                       for total, error, densities, mass in zip(
                           list_finite(computed.log10_likelihood), list_finite(computed.error),
                           list_finite(computed.log10_density) if is_detailed else [None] * len(computed.error),
                           computed.mass_outside.tolist(), strict=True)]}

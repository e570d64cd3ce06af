"""What several operations share: names, conditions, inputs, the outside policy, and numbers in JSON."""

from typing import Annotated, Any

import numpy as np
import orjson
from fastapi import Depends, Request
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field

from service.problem_details import TooLarge
from service.settings import Settings
from slipstick.errors import InvalidValue
from slipstick.storage.library import Library
from slipstick.table import Outside, Table
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.chaos import Family

SIMULATED = ("The shipped recordings `measured` are simulated test-bench data from an independent implementation: "
             "the recordings of the paper are not public.")


class Strict(BaseModel):
    """A request body: a field that nobody knows is an error, not ignored."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


TableName = Annotated[str, Field(description="Name of a table, see /v1/tables.", examples=["nominal"])]
RecordingsName = Annotated[str, Field(
    description=f"Name of recordings, see /v1/recordings. {SIMULATED}", examples=["measured"])]
OutsidePolicy = Annotated[Outside, Field(
    description="What holds beyond the edges of the table, for points, nodes and samples alike: `clip` takes the value "
                "at the nearest edge, `error` refuses, `nan` leaves a gap.")]
ConditionList = Annotated[list[int] | None, Field(
    min_length=1, max_length=100_000,
    description="The conditions wanted, by their number in the table from 0; null for all.", examples=[[0, 100, 215]])]
Digest = Annotated[str, Field(description="SHA-256 of the content that the answer was computed from.")]
TableDigest = Annotated[str, Field(description="Content digest (SHA-256) of the table the answer was computed from.")]
MassOutside = Annotated[float, Field(
    description="Probability that the inputs lie outside the table, where the policy `outside` applies.")]


class InputsBody(Strict):
    """Uncertain inputs as multiples of the nominal values, one an axis: mean, spread, family and correlation."""

    mean: list[float] = Field(min_length=1, max_length=20, examples=[[1.0, 1.0]],
                              description="Mean of each input, in multiples of its nominal value.")
    std: list[float] | None = Field(
        default=None, max_length=20, examples=[[0.05, 0.08]],
        description="Standard deviation of each input in multiples of nominal. Give either `std` or `mixing`.")
    families: list[Family] | None = Field(
        default=None, max_length=20, examples=[["normal", "gamma"]],
        description="Family of each input, normal unless said otherwise; mean and std are those of the input itself.")
    correlation: list[list[float]] | None = Field(
        default=None, max_length=20, examples=[[[1.0, -0.5], [-0.5, 1.0]]],
        description="Correlation of the normal scores of the inputs, row by row: of the inputs themselves where they "
                    "are normal, a Gaussian copula otherwise.")
    support: list[tuple[float, float]] | None = Field(
        default=None, max_length=20, description="Range of each beta input; that of its axis unless said otherwise.")
    mixing: list[list[float]] | None = Field(
        default=None, max_length=20,
        description="For normal inputs the matrix L of x = mean + L normals, row by row, instead of `std`. Its "
                    "off-diagonal entries mix germs (the paper's sigma12): the covariance is L L^T.")

    def inputs(self, table: Table) -> Inputs:
        """Return them as the inputs of `table`; raises `InvalidValue`."""
        names = [axis.name for axis in table.axes]
        if len(self.mean) != len(names):
            raise InvalidValue(f"There are {len(self.mean)} means for the {len(names)} axes of the table",
                               f"Give one each of {', '.join(names)}")
        for what, rows in (("mixing matrix", self.mixing), ("correlation", self.correlation)):
            if rows is not None and any(len(row) != len(names) for row in rows):
                raise InvalidValue(f"The rows of the {what} differ in length",
                                   f"Give {len(names)} rows of {len(names)} numbers")
        support = np.column_stack([table.lower, table.upper]) if self.support is None else np.array(self.support)
        return Inputs(np.array(self.mean), None if self.std is None else np.array(self.std),
                      None if self.mixing is None else np.array(self.mixing), tuple(self.families or ()),
                      None if self.correlation is None else np.array(self.correlation), support)


def library(request: Request) -> Library:
    """The library of the application that answers."""
    found: Library = request.app.state.library
    return found


def settings(request: Request) -> Settings:
    """The settings of the application that answers."""
    found: Settings = request.app.state.settings
    return found


TheLibrary = Annotated[Library, Depends(library)]
TheSettings = Annotated[Settings, Depends(settings)]


def chosen(table: Table, conditions: list[int] | None) -> tuple[Table, list[int]]:
    """The table of only the chosen conditions, and their numbers; raises `InvalidValue` on one it lacks."""
    n = len(table.conditions)
    if conditions is None:
        return table, list(range(n))
    if len(set(conditions)) < len(conditions):
        raise InvalidValue("A condition is asked for twice", "Name each condition once")
    unknown = [number for number in conditions if not 0 <= number < n]
    if unknown:
        raise InvalidValue(f"The table has no condition {unknown[0]}", f"Its conditions are numbered 0 to {n - 1}")
    return table.restricted(table.conditions.take(conditions)), conditions


def require_size(count: int, limit: int, what: str, remedy: str) -> None:
    """Refuse what is too much; raises `TooLarge`."""
    if count > limit:
        raise TooLarge(f"The request asks for {count:,} {what}, the service allows {limit:,}", remedy)


def numbers(content: dict[str, Any], headers: dict[str, str] | None = None) -> Response:
    """Answer with arrays as JSON, NaN and infinities as null: orjson writes them faster than a schema checks them."""
    text = orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY, default=np.ndarray.tolist)
    return Response(text, headers=headers, media_type="application/json")

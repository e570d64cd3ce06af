"""Fields, dependencies and helpers shared by several operations."""

from typing import Annotated, Any

import numpy as np
import orjson
from fastapi.responses import Response
from pydantic import BaseModel, ConfigDict, Field, Strict

from slipstick.storage.library import Library
from slipstick.table import Outside, Table
from slipstick.uncertainty.chaos import Family

from .held import held
from .problem_details import TooLarge
from .settings import Settings

SIMULATED = ("The recordings `measured` that are shipped with Slipstick are simulated test-bench data from an "
             "independent implementation; the recordings of the paper are not public.")


class StrictModel(BaseModel):
    """A request body that rejects unknown fields, NaN, infinity, and `true` or "1.0" in place of a number."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)


Range = Annotated[tuple[float, float], Strict(False)]
"""Lower and upper end. A tuple is read from a list; its numbers are strict like those of the model around it."""


TableName = Annotated[str, Field(description="Name of a table; GET /v1/tables lists the tables.",
                                 examples=["nominal"])]
RecordingsName = Annotated[str, Field(
    description=f"Name of the recordings; GET /v1/recordings lists them. {SIMULATED}", examples=["measured"])]
BenchName = Annotated[str | None, Field(
    description="Name of the bench, see /v1/benches. By default the bench that fits the other input; an error if none "
                "or more than one does.", examples=["heavy"])]
TableBench = Annotated[str | None, Field(
    description="Name of the bench of the table, see /v1/benches. A table of another bench is rejected with 422; by "
                "default the bench is not checked.", examples=["heavy"])]
OutsidePolicy = Annotated[Outside, Field(
    description="Policy for points outside the table: `error` rejects the request, `clip` uses the value at the "
                "nearest point of the table's edge, `nan` treats the shifting time as missing. It applies to "
                "evaluation points, quadrature nodes and samples alike; a point that is outside by rounding only is "
                "inside.")]
ConditionList = Annotated[list[int] | None, Field(
    min_length=1, max_length=100_000,
    description="Indices (from 0) of the conditions of the table to use; null for all conditions.",
    examples=[[0, 100, 215]])]
Digest = Annotated[str, Field(description="SHA-256 digest of the content.")]
TableDigest = Annotated[str, Field(description="SHA-256 digest of the content of the table.")]
RecordingsDigest = Annotated[str, Field(description="SHA-256 digest of the recordings.")]
Description = Annotated[str, Field(description="The condition in words: profile, motor speed, inertia and brake "
                                               "torque, or the columns of another machine.")]
MassOutside = Annotated[float, Field(
    description="Probability that the inputs lie outside the table, where the policy `outside` applies.")]


class AxisUnit(BaseModel):
    """An axis of a table, and what its multiple 1 stands for."""

    name: str = Field(description="Name of the parameter.")
    nominal: float = Field(description="Value of the parameter at the multiple 1, in `unit`.")
    unit: str = Field(description="Unit of the parameter.")

    @classmethod
    def of(cls, table: Table) -> list[dict[str, Any]]:
        """The axes of a table as JSON."""
        return [{name: getattr(axis, name) for name in cls.model_fields} for axis in table.axes]


AxisUnits = Annotated[list[AxisUnit], Field(
    description="The axes of the table in the order of the inputs, with the physical value of the multiple 1.")]


class InputsBody(StrictModel):
    """Probability distribution of the uncertain inputs, one input per axis, in multiples of the nominal values."""

    mean: list[float] = Field(min_length=1, max_length=20, examples=[[1.0, 1.0]],
                              description="Mean of each input, in multiples of its nominal value.")
    std: list[float] | None = Field(
        default=None, max_length=20, examples=[[0.05, 0.08]],
        description="Standard deviation of each input, in multiples of its nominal value. Either `std` or `mixing` is "
                    "required.")
    families: list[Family] | None = Field(
        default=None, max_length=20, examples=[["normal", "gamma"]],
        description="Distribution family of each input; by default all are normal. `mean` and `std` are those of the "
                    "input itself for every family.")
    correlation: list[list[float]] | None = Field(
        default=None, max_length=20, examples=[[[1.0, -0.5], [-0.5, 1.0]]],
        description="Correlation matrix of the normal scores of the inputs, row by row. For normal inputs this is the "
                    "correlation of the inputs themselves, for other families it defines a Gaussian copula.")
    support: list[Range] | None = Field(
        default=None, max_length=20, description="Range (lower, upper) of each input, used for the family `beta`; by "
                                                 "default the range of its axis.")
    mixing: list[list[float]] | None = Field(
        default=None, max_length=20,
        description="Matrix L in x = mean + L z with standard normals z, row by row; an alternative to `std` for "
                    "normal inputs. The covariance of the inputs is L L^T. The off-diagonal entry sigma12 of the paper "
                    "is an entry of L, not a covariance.")


LibraryDependency = Annotated[Library, held("library")]
SettingsDependency = Annotated[Settings, held("settings")]


def require_size(count: int, limit: int, quantity: str, remedy: str) -> None:
    """Raise `TooLarge` if a request requires more than `limit` values of a quantity."""
    if count > limit:
        raise TooLarge(f"The request requires {count:,} {quantity}; the limit is {limit:,}", remedy)


def json_response(content: dict[str, Any], headers: dict[str, str] | None = None) -> Response:
    """Return content with arrays as JSON, NaN and infinity as null.

    orjson serialises large arrays much faster than the validation of a response model.
    """
    text = orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY, default=np.ndarray.tolist)
    return Response(text, headers=headers, media_type="application/json")


def open_table(library: Library, name: str, bench: str | None) -> Table:
    """Open a table; raises `InvalidValue` if a bench is given and the table is one of another bench."""
    table = library.table(name)
    if bench is not None:
        library.bench(bench).require(table.clutch.physics)
    return table

"""The operations of UM-Bridge 1.0 under /umbridge, which its clients take as the URL of a server."""

from typing import Annotated, Any, TypeVar

import numpy as np
from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from slipstick.errors import InvalidValue
from slipstick.storage.library import Library

from ..bodies import JsonRoute, parse, validate
from ..computations import Client, ClientDependency, computes
from ..problem_details import TooLarge
from ..schemas import LibraryDependency, SettingsDependency
from ..settings import Settings
from ..umbridge.errors import PREFIX, error_responses, require_loopback
from ..umbridge.models import BridgeModel, UndefinedOutput, contracted, names, open_model, require_known

router = APIRouter(prefix=PREFIX, tags=["UM-Bridge"], route_class=JsonRoute, dependencies=[Depends(require_loopback)],
                   responses=error_responses())
_Numbers = list[float]
_Request = TypeVar("_Request", bound=BaseModel)


class Named(BaseModel):
    """The model of a request; further members are ignored, as clients differ in what they send."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)

    name: str = Field(description="Name of the model, such as `nominal` or `nominal/measured`.")


class Configured(Named):
    """A model with its options."""

    config: dict[str, Any] = Field(
        default_factory=dict,
        description="Options. `outside` is the policy outside the table (`clip`, `error`, `nan`), `error` by default "
                    "for a table, `clip` for a table with recordings. A table takes `conditions`, a list of indices; a "
                    "table with recordings takes `logarithm`, `log10` or `ln`.")


class EvaluateBody(Configured):
    """A point at which to evaluate a model."""

    input: list[_Numbers] = Field(description="One input vector, in a list.")


class _Derivative(EvaluateBody):
    outWrt: int = Field(description="Index of the output vector: 0.")


class GradientBody(_Derivative):
    """A point, and weights of the outputs."""

    inWrt: int = Field(description="Index of the input vector: 0.")
    sens: _Numbers = Field(description="Weight of each output.")


class JacobianBody(_Derivative):
    """A point, and a direction."""

    inWrt: int = Field(description="Index of the input vector: 0.")
    vec: _Numbers = Field(description="Direction: one number per input.")


class HessianBody(_Derivative):
    """A point, weights of the outputs, and a direction."""

    inWrt1: int = Field(description="Index of the input vector of the first derivative: 0.")
    inWrt2: int = Field(description="Index of the input vector of the second derivative: 0.")
    sens: _Numbers = Field(description="Weight of each output.")
    vec: _Numbers = Field(description="Direction: one number per input.")


class Info(BaseModel):
    """The models of the server."""

    protocolVersion: float = Field(description="Version of the protocol.")
    models: list[str] = Field(description="Names of the models: tables, and `TABLE/RECORDINGS`.")


class Support(BaseModel):
    """The operations that a model supports."""

    Evaluate: bool = Field(default=True, description="Always true.")
    Gradient: bool = Field(default=True, description="Always true.")
    ApplyJacobian: bool = Field(default=True, description="Always true.")
    ApplyHessian: bool = Field(default=True, description="Always true.")


class ModelInfo(BaseModel):
    """What a model supports."""

    support: Support = Field(description="Whether each operation is supported.")


class InputSizes(BaseModel):
    """Sizes of the input vectors."""

    inputSizes: list[int] = Field(description="Number of axes of a table (d); with recordings 2 d + 1.")


class OutputSizes(BaseModel):
    """Sizes of the output vectors."""

    outputSizes: list[int] = Field(description="Number of conditions of a table; with recordings 1.")


class Vectors(BaseModel):
    """Output vectors."""

    output: list[_Numbers] = Field(description="One output vector, in a list.")


class Vector(BaseModel):
    """One vector."""

    output: _Numbers = Field(description="The vector.")


_TABLE: dict[str, Any] = {"name": "nominal", "config": {"conditions": [0, 1]}}
_AT: dict[str, Any] = {**_TABLE, "input": [[1.1, 0.95]], "outWrt": 0}


def _body(kind: type[BaseModel], example: dict[str, Any]) -> dict[str, Any]:
    return {"requestBody": {"required": True, "content": {
        "application/json": {"schema": kind.model_json_schema(), "example": example}}}}


async def _read_body(request: Request, settings: SettingsDependency) -> bytes:
    # Clients send JSON under any media type, so the limit of JSON bodies has to be checked here.
    content = await request.body()
    if len(content) > settings.json_bytes:
        raise TooLarge(f"The JSON body is larger than {settings.json_bytes:,} bytes",
                       "Send a smaller body, or increase SLIPSTICK_JSON_BYTES on the server")
    return content


Content = Annotated[bytes, Depends(_read_body)]


@router.get("/Info", summary="List the UM-Bridge models")
def bridge_info(library: LibraryDependency) -> Info:
    """Return the names of all models: every table, and every table with recordings whose conditions it contains."""
    return Info(protocolVersion=1.0, models=names(library))


@router.post("/ModelInfo", summary="What a UM-Bridge model supports", openapi_extra=_body(Named, {"name": "nominal"}))
def bridge_model_info(content: Content, library: LibraryDependency) -> ModelInfo:
    """Return the operations that a model supports: every model supports all of them."""
    require_known(library, validate(Named, parse(content)).name)
    return ModelInfo(support=Support())


@router.post("/InputSizes", summary="Input sizes of a UM-Bridge model", openapi_extra=_body(Configured, _TABLE))
def bridge_input_sizes(content: Content, library: LibraryDependency, settings: SettingsDependency) -> InputSizes:
    """Return the size of the only input vector: one multiple per axis of a table, or means, stds and output std."""
    _, model = _open_request(content, Configured, library, settings)
    return InputSizes(inputSizes=[model.inputs])


@router.post("/OutputSizes", summary="Output sizes of a UM-Bridge model", openapi_extra=_body(Configured, _TABLE))
def bridge_output_sizes(content: Content, library: LibraryDependency, settings: SettingsDependency) -> OutputSizes:
    """Return the size of the only output vector: one value per condition of a table, or one log10 likelihood."""
    _, model = _open_request(content, Configured, library, settings)
    return OutputSizes(outputSizes=[model.outputs])


@router.post("/Evaluate", summary="Evaluate a UM-Bridge model",
             openapi_extra=_body(EvaluateBody, {**_TABLE, "input": [[1.0, 1.0]]}))
@computes
def bridge_evaluate(content: Content, library: LibraryDependency, settings: SettingsDependency,
                    client: ClientDependency) -> Vectors:
    """Return the output at a point.

    A table returns the shifting time of each condition in s at multiples of the nominal values. A table with recordings
    returns the log10 likelihood (densities per ms) at the means, the stds and the output std, in this order, for
    independent normal inputs. A likelihood of 0, as for a negative std, is -1.7976931348623157e308.
    """
    body, model = _open_request(content, EvaluateBody, library, settings, client)
    return Vectors(output=[_list_finite(model.value(_point(body, model)))])


@router.post("/Gradient", summary="Gradient of a UM-Bridge model",
             openapi_extra=_body(GradientBody, {**_AT, "inWrt": 0, "sens": [1.0, 0.0]}))
@computes
def bridge_gradient(content: Content, library: LibraryDependency, settings: SettingsDependency,
                    client: ClientDependency) -> Vector:
    """Return the gradient of the outputs weighted by `sens`: the transposed Jacobian times `sens`."""
    body, model = _open_request(content, GradientBody, library, settings, client)
    point = _point(body, model, inWrt=body.inWrt)
    sens = _vector("sens", body.sens, model.outputs)
    return Vector(output=_list_finite(contracted(model.jacobian(point).T, sens)))


@router.post("/ApplyJacobian", summary="Apply the Jacobian of a UM-Bridge model",
             openapi_extra=_body(JacobianBody, {**_AT, "inWrt": 0, "vec": [1.0, 0.0]}))
@computes
def bridge_apply_jacobian(content: Content, library: LibraryDependency, settings: SettingsDependency,
                          client: ClientDependency) -> Vector:
    """Return the Jacobian times `vec`: the derivative of each output along a direction."""
    body, model = _open_request(content, JacobianBody, library, settings, client)
    point = _point(body, model, inWrt=body.inWrt)
    vec = _vector("vec", body.vec, model.inputs)
    return Vector(output=_list_finite(contracted(model.jacobian(point), vec)))


@router.post("/ApplyHessian", summary="Apply the Hessian of a UM-Bridge model",
             openapi_extra=_body(HessianBody, {**_AT, "inWrt1": 0, "inWrt2": 0, "sens": [1.0, 0.0],
                                               "vec": [1.0, 0.0]}))
@computes
def bridge_apply_hessian(content: Content, library: LibraryDependency, settings: SettingsDependency,
                         client: ClientDependency) -> Vector:
    """Return the Hessian of the outputs weighted by `sens`, times `vec`."""
    body, model = _open_request(content, HessianBody, library, settings, client)
    point = _point(body, model, inWrt1=body.inWrt1, inWrt2=body.inWrt2)
    sens, vec = _vector("sens", body.sens, model.outputs), _vector("vec", body.vec, model.inputs)
    return Vector(output=_list_finite(model.apply_hessian(point, sens, vec)))


def _open_request(content: bytes, kind: type[_Request], library: Library, settings: Settings,
                  client: Client | None = None) -> tuple[_Request, BridgeModel]:
    """The request and its model; an unknown model is reported before other mistakes."""
    body = parse(content)
    require_known(library, validate(Named, body).name)
    configured = validate(Configured, body)
    model = open_model(library, settings, client, configured.name, configured.config)
    return validate(kind, body), model


def _point(body: EvaluateBody, model: BridgeModel, **indices: int) -> np.ndarray:
    """The input vector (k,); raises `InvalidValue` for a wrong size, or for an index of a vector that is not 0."""
    if isinstance(body, _Derivative):
        indices["outWrt"] = body.outWrt
    for name, index in indices.items():
        if index != 0:
            raise InvalidValue(f"`{name}` is {index}", "Give 0: the models have one input and one output vector")
    if len(body.input) != 1:
        raise InvalidValue(f"`input` has {len(body.input)} vectors", "Give one input vector, in a list")
    return _vector("input[0]", body.input[0], model.inputs)


def _vector(name: str, numbers: list[float], size: int) -> np.ndarray:
    if len(numbers) != size:
        raise InvalidValue(f"`{name}` has {len(numbers)} numbers", f"Give {size}")
    return np.array(numbers)


def _list_finite(values: np.ndarray) -> list[float]:
    """The values as JSON, which has no NaN; raises `UndefinedOutput`."""
    undefined = np.flatnonzero(~np.isfinite(values))
    if len(undefined):
        listed = ", ".join(map(str, undefined[:10])) + " and others" * (len(undefined) > 10)
        raise UndefinedOutput(f"{len(undefined)} of {len(values)} outputs are undefined at this point (indices: "
                              f"{listed})", "Give another point, or select other conditions with "
                              '`config`: {"conditions": [...]}')
    numbers: list[float] = values.tolist()
    return numbers

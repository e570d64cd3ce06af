"""The residuals of a fit: what was measured and what is predicted, for each engagement."""

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field

from slipstick.interface.tables import condition_columns
from slipstick.pictures.conditions import described
from slipstick.pictures.output import Output

from ..bodies import JsonRoute
from ..csv_form import CSV_RESPONSE, TableFormQuery, csv_response, wants_csv
from ..error_responses import error_responses
from ..jobs import finished_job, output_of, version_of
from ..revalidation import NOT_MODIFIED, RevalidationDependency
from ..routes.fits import FitId, FitStore
from ..schemas import Description

router = APIRouter(prefix="/v1/fits/{id}/residuals", tags=["fits"], route_class=JsonRoute)


class Residual(BaseModel):
    """One engagement. Outputs of another machine are in their own unit instead of s."""

    condition: int = Field(description="Index of the engagement in the recordings, from 0.")
    described: Description
    measured: float = Field(description="Measured shifting time in s.")
    before: float | None = Field(description="Predicted shifting time at the nominal inputs in s; null if it does not "
                                             "lock.")
    predicted: float | None = Field(description="Mean of the predicted shifting time with the fitted inputs in s.")
    std: float | None = Field(description="Standard deviation of the prediction in s, with the output noise.")
    residual: float | None = Field(description="Measured minus predicted shifting time in s.")


class Residuals(BaseModel):
    """The residuals of a fit."""

    id: str = Field(description="Id of the fit.")
    residuals: list[Residual] = Field(description="The residuals, in the order of the recordings.")


@router.get("", summary="Get the residuals of a fit", response_model=Residuals,
            responses=error_responses(404, 409, 503) | CSV_RESPONSE | NOT_MODIFIED)
def fit_residuals(id: FitId, store: FitStore, request: Request, client: RevalidationDependency,
                  form: TableFormQuery = None) -> Residuals | Response:
    """Return measured and predicted shifting times of every engagement; 409 unless the fit is done.

    CSV has a row for each engagement, with its condition in columns.
    """
    fit = finished_job(store, id)
    client.require_change(version_of(fit))
    data = output_of(fit)["figure_data"]
    given, prediction = data["conditions"], data["prediction"]
    rows = [Residual(condition=number, described=described(given, number), measured=measured, before=before,
                     predicted=mean, std=std, residual=None if mean is None else measured - mean)
            for number, measured, before, mean, std in zip(*(
                prediction[name] for name in ("condition", "measured", "before", "mean", "std")), strict=True)]
    if not wants_csv(request, form):
        return Residuals(id=id, residuals=rows)
    numbers, unit = ("measured", "before", "predicted", "std", "residual"), Output.of(data).unit
    taken = {name: [column[row.condition] for row in rows] for name, column in condition_columns(given).items()}
    return csv_response({"condition": [row.condition for row in rows], **taken,
                         **{f"{name} [{unit}]": [getattr(row, name) for row in rows] for name in numbers}},
                        f"{id}_residuals")

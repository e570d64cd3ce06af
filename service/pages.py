"""The page /docs: Swagger UI served from this package, so that it works without internet access."""

from pathlib import Path

from fastapi import FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles

_STATIC = Path(__file__).parent / "static"


def install(app: FastAPI) -> None:
    """Serve /docs and the static files that it refers to by relative addresses."""
    app.mount("/static", StaticFiles(directory=_STATIC), name="static")

    @app.get("/docs", include_in_schema=False)
    def docs() -> HTMLResponse:
        return get_swagger_ui_html(
            openapi_url="openapi.json", title=app.title,
            swagger_js_url="static/swagger/swagger-ui-bundle.js",
            swagger_css_url="static/swagger/swagger-ui.css",
            swagger_favicon_url="static/swagger/favicon-32x32.png",
            # The validator badge would need internet access.
            swagger_ui_parameters={"validatorUrl": None, "displayRequestDuration": True,
                                   "defaultModelsExpandDepth": 0,
                                   # A field for a file also where the document, for generated clients, says text.
                                   "fileUploadMediaTypes": ["application/octet-stream", "text/csv"]},
        )

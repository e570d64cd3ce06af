"""The extras of the package: which one installs a library that is missing."""

_EXTRAS = {
    "service": ("dbos", "fastapi", "orjson", "prometheus_client", "psycopg", "pydantic", "pydantic_settings",
                "sqlalchemy", "starlette", "uvicorn"),
    "reports": ("vl_convert",), "mdf": ("asammdf",), "parquet": ("pyarrow",), "dask": ("distributed", "dask"),
    "fmu": ("fmpy",)}
"""Extra -> the libraries that it installs, by the names under which they are imported."""


def remedy_of(error: ImportError) -> str | None:
    """How to install what a failed import needs; None where no extra has it."""
    library = (error.name or "").split(".")[0]
    for extra, libraries in _EXTRAS.items():
        if library in libraries:
            return f"This needs {library}, which is not installed. Install it: pip install 'slipstick[{extra}]'"
    return None

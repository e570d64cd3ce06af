"""Settings of the service, each read from an environment variable with the prefix `SLIPSTICK_`."""

from pathlib import Path
from typing import Literal

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """Settings of the service; the environment variable of a field is SLIPSTICK_ and its name in capitals."""

    model_config = SettingsConfigDict(env_prefix="SLIPSTICK_", frozen=True)

    tables: Path = Field(default=Path("tables"), description="Folder that contains the tables and the recordings.")
    jobs: str = Field(
        default="sqlite:///var/jobs.sqlite", repr=False,  # it may contain a password
        description="URL of the job database; the worker must use the same URL.",
    )
    host: str = Field(default="127.0.0.1", description="Address to listen on; 0.0.0.0 listens on all interfaces.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on.")
    hosts: str = Field(default="localhost,127.0.0.1,[::1]",
                       description="Host names under which the service answers, separated by commas; `*` for all.")
    tokens: Path | Literal["off"] | None = Field(
        default=None, description="File of the tokens; required beyond the loopback address, unless it is `off`.")
    log: Literal["json", "text"] | None = Field(
        default=None, description="Form of the log on standard error: `json`, an object for each line, or `text`; by "
                                  "default text on a terminal, and JSON elsewhere.")
    body_bytes: int = Field(default=64 << 20, gt=0, description="Maximum size of a request body in bytes.")
    json_bytes: int = Field(default=2 << 20, gt=0, description="Maximum size of a JSON body in bytes; larger "
                                                               "arrays fit as .npy.")
    bodies_bytes: int = Field(default=256 << 20, gt=0, description="Maximum size in bytes of all request bodies in "
                                                                   "memory together.")
    body_seconds: float = Field(default=30.0, gt=0, description="Maximum time in s to receive the headers "
                                                               "or the body of a request.")
    computations: int = Field(default=2, gt=0, description="Maximum number of requests that compute at once.")
    uploads: int = Field(default=1, gt=0, description="Maximum number of uploads that are read at once.")
    waiting: int = Field(default=64, ge=0, description="Maximum number of requests that wait to compute.")
    waiting_seconds: float = Field(default=30.0, gt=0, description="Maximum time in s to wait for a computation.")
    followers: int = Field(default=200, ge=0, description="Maximum number of clients that wait for jobs at once, by "
                                                         "events or by `wait`.")
    follow_seconds: float = Field(default=300.0, gt=0, description="Maximum time in s of an event stream or of a "
                                                                   "`wait` for a job; clients then ask again.")
    folder_bytes: int = Field(default=16 << 30, gt=0, description="Maximum size in bytes of the folder of the tables "
                                                                  "after an upload.")
    engagements: int = Field(default=20_000, gt=0, description="Maximum number of engagements of uploaded recordings.")
    answer_values: int = Field(default=2_000_000, gt=0, description="Maximum number of values in one response, except "
                                                                    "as .npy.")
    array_values: int = Field(default=4_000_000, gt=0, description="Maximum number of values in one response as .npy; "
                                                                   "each takes 8 bytes.")
    fit_values: int = Field(default=4_000_000_000_000, gt=0, description="Maximum cost of a fit in interpolations of "
                                                                         "shifting times; about 6 hours on one core.")
    build_runs: int = Field(default=100_000_000, gt=0, description="Maximum number of runs of a table that a job "
                                                                   "builds; about 3 minutes on one core for a clutch.")
    kept_days: float = Field(default=365.0, gt=0, description="Time in days for which jobs that have ended are kept.")
    kept_jobs: int = Field(default=10_000, ge=0, description="Maximum number of ended jobs that are kept, the newest.")
    work_values: int = Field(
        default=1_000_000_000, gt=0, description="Maximum number of intermediate values computed for one request.")

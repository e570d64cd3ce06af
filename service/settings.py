"""What an operator can set, each by an environment variable that starts with `SLIPSTICK_`."""

from pathlib import Path

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """The settings of the service; every field can be set as SLIPSTICK_ and its name in capitals."""

    model_config = SettingsConfigDict(env_prefix="SLIPSTICK_", frozen=True)

    tables: Path = Field(default=Path("tables"), description="Folder of the table files and the recordings.")
    jobs: str = Field(
        default="sqlite:///var/jobs.sqlite",
        description="URL of the database that holds fits and studies; the worker must be given the same one.",
    )
    host: str = Field(default="127.0.0.1", description="Address to listen on; 0.0.0.0 for every network.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on.")
    body_bytes: int = Field(default=64 << 20, gt=0, description="Largest request body in bytes.")
    body_seconds: float = Field(default=30.0, gt=0, description="Longest time in s for a request body to arrive.")
    answer_values: int = Field(default=2_000_000, gt=0, description="Most numbers that one answer may hold.")
    work_values: int = Field(
        default=1_000_000_000, gt=0, description="Most numbers that one request may have computed on the way.")

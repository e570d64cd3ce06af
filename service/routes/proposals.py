"""A proposed mapping of the channels of an uploaded file, as the first step of an import."""

import tomllib
from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from slipstick.acquisition.channel import Listed
from slipstick.acquisition.proposing import propose_uploaded

from ..bodies import JsonRoute, upload_of
from ..computations import reads_upload
from ..error_responses import error_responses
from ..machines import MachinesDependency
from ..routes.imports import example_file
from ..schemas import LibraryDependency
from ..subjects import ImportBench, ImportMachine, find_subject

router = APIRouter(prefix="/v1/recordings", tags=["recordings"], route_class=JsonRoute)

MEDIA_TYPE = "application/octet-stream"
_UPLOAD_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {MEDIA_TYPE: {
    "schema": {"type": "string", "format": "binary", "contentEncoding": "base64"}, "example": example_file()}}}}


class FileChannel(BaseModel):
    """A channel of a file."""

    name: str = Field(description="Name of the channel.")
    unit: str = Field(description="Unit of the channel; empty where the file states none.")
    samples: int = Field(description="Number of samples.")

    @classmethod
    def of(cls, channel: Listed) -> "FileChannel":
        """A channel as the service describes it."""
        return cls(name=channel.name, unit=channel.unit, samples=channel.samples)


class ChannelGuess(BaseModel):
    """The channel that is proposed for a signal, an instant or a condition."""

    name: str = Field(description="What the channel is proposed for, such as `pressure` or `shift_command`.")
    channel: FileChannel | None = Field(description="The proposed channel; null where none fits.")
    reason: str = Field(description="Why it is proposed, or why none is.")
    sure: bool = Field(description="Whether its unit, and no other channel, fits.")


class MappingProposal(BaseModel):
    """A proposed mapping."""

    channels: list[FileChannel] = Field(description="The channels of the file.")
    guesses: list[ChannelGuess] = Field(description="The guesses, each with its reason.")
    mapping: dict[str, Any] = Field(description="The proposed mapping, as the TOML file `channels.toml` says it.")
    open_keys: list[str] = Field(description="What is left to fill in.")
    text: str = Field(description="The file `channels.toml`, with the reasons as comments.")


FileName = Annotated[str, Query(max_length=255, description="Name of the file; its extension tells some formats apart.",
                                openapi_examples={"csv": {"summary": "A CSV file", "value": "run.csv"}})]


@router.post("/proposal", summary="Propose a mapping of channels", openapi_extra=_UPLOAD_BODY,
             responses=error_responses(404, 408, 413, 415, 503))
@reads_upload
def propose_mapping(file: FileName, content: Annotated[bytes, upload_of(MEDIA_TYPE)], library: LibraryDependency,
                    machines: MachinesDependency, bench: ImportBench = None,
                    machine: ImportMachine = None) -> MappingProposal:
    """Read a file of a data-acquisition system and propose which channel is which signal of a `bench` or `machine`.

    The request body is the file (MDF, MATLAB, CSV or Parquet; Content-Type application/octet-stream). Nothing is
    stored. Complete the proposal, and import the files with it by `POST /v1/recordings/import`. The file is read in a
    child process with limited time and memory.
    """
    proposed = propose_uploaded(file, content, find_subject(library, machines, bench, machine))
    proposal = proposed.proposal
    return MappingProposal(
        channels=[FileChannel.of(channel) for channel in proposed.channels], open_keys=list(proposal.open_keys),
        guesses=[ChannelGuess(name=guess.name, channel=None if guess.channel is None else FileChannel.of(guess.channel),
                              reason=guess.reason, sure=guess.sure) for guess in proposal.guesses],
        mapping=tomllib.loads(proposal.text), text=proposal.text)

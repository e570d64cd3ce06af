"""A mapping proposed for an uploaded file of a bench or machine, which is read in a limited child process."""

import io
import json
from dataclasses import asdict, dataclass

from slipstick.acquisition.channel import Listed
from slipstick.acquisition.guess import Guess, Proposal, propose, propose_for_machine
from slipstick.acquisition.opening import open_source
from slipstick.acquisition.subject import Subject, name_subject, open_subject
from slipstick.bench import Bench
from slipstick.errors import BadRecording
from slipstick.machine import channels_of
from slipstick.storage.isolated import isolated

_SECONDS = 60  # of processor time
_FAILED = "The reading of the file crashes, or needs more than a minute or 4 GB"


@dataclass(frozen=True)
class UploadedProposal:
    """The `channels` of a file, and what is proposed for them."""

    channels: tuple[Listed, ...]
    proposal: Proposal


def propose_uploaded(name: str, content: bytes, subject: Subject) -> UploadedProposal:
    """A mapping for files like the one with these bytes, called `name`, of a `subject`; raises `BadRecording`."""
    request = name_subject(subject, name=name) + content
    answered = json.loads(isolated(request, "slipstick.acquisition.proposing:answer", BadRecording, _SECONDS, _FAILED))
    guesses = tuple(Guess(**{**guess, "channel": guess["channel"] and Listed(**guess["channel"])})
                    for guess in answered["proposal"]["guesses"])
    proposal = Proposal(answered["proposal"]["text"], guesses, tuple(answered["proposal"]["open_keys"]))
    return UploadedProposal(tuple(Listed(**channel) for channel in answered["channels"]), proposal)


def answer(request: bytes) -> bytes:
    """In the child process: the channels and the proposal as JSON."""
    said, _, content = request.partition(b"\n")
    source, subject = open_source(json.loads(said)["name"], io.BytesIO(content)), open_subject(said)
    proposal = propose(source, subject) if isinstance(subject, Bench) else propose_for_machine(
        source, channels_of(subject))
    proposed = UploadedProposal(source.listed(), proposal)
    return json.dumps(asdict(proposed)).encode()

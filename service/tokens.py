"""Bearer tokens: who may send requests, with which of three roles. The file holds their digests only.

A line of the file is `NAME ROLE DIGEST`, and `slipstick token NAME ROLE` makes one with its token. A token has
256 random bits, so its SHA-256 cannot be reversed by guessing, and needs neither salt nor stretching.
"""

import base64
import binascii
import hashlib
import hmac
import ipaddress
import re
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from slipstick.errors import SlipstickError

from .settings import Settings
from .umbridge.errors import PREFIX

Role = Literal["read", "run", "admin"]
"""`read`: everything that changes nothing and stores nothing. `run`: also computations, uploads and jobs. `admin`: also
the deletion and renaming of files, which others may need."""
ROLES: tuple[Role, ...] = get_args(Role)

_NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_LINE = re.compile(rf"(?P<name>{_NAME})\s+(?P<role>{'|'.join(ROLES)})\s+(?P<digest>[0-9a-f]{{64}})")
READING = ("GET", "HEAD", "OPTIONS")
"""Methods that change nothing."""
_OPEN = ("/docs", "/openapi.json", "/v1/health", "/v1/live", "/v1/ready")
_REMEDY = "Write each line as `slipstick token NAME ROLE` prints it"


class BadTokens(SlipstickError):
    """The token file cannot be used, or one is required."""


@dataclass(frozen=True)
class Caller:
    """The owner of a token."""

    name: str
    role: Role

    def may(self, role: Role) -> bool:
        """Whether the caller has this role; each role includes those before it."""
        return ROLES.index(self.role) >= ROLES.index(role)


def required_role(method: str, path: str) -> Role | None:
    """Return the role that a request needs; None if it needs no token.

    Without token are the documentation, the health checks, which a supervisor asks, and UM-Bridge, whose clients cannot
    send one and which answers this machine only (`require_loopback`).
    """
    if path.startswith(f"{PREFIX}/"):
        return None
    if method in READING:
        return None if path in _OPEN or path.startswith("/static/") else "read"
    is_file = path.startswith(("/v1/tables/", "/v1/recordings/", "/v1/benches/"))
    return "admin" if is_file and method in ("DELETE", "PATCH") else "run"


def new_token(name: str, role: Role) -> tuple[str, str]:
    """Return a new token, and its line of the file; raises `BadTokens` for a name with other characters."""
    token = secrets.token_urlsafe(32)
    line = f"{name} {role} {_digest(token)}"
    if not _LINE.fullmatch(line):
        raise BadTokens(f"'{name}' is not a name", "Use up to 64 letters, digits, '.', '_' and '-'")
    return token, line


class Tokens:
    """The tokens in the file `path`, which is read again whenever it changes: a deleted line ends its token at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.version: tuple[int, int, int] | None = None
        self.callers: list[tuple[bytes, Caller]] = []

    def caller(self, authorization: str) -> Caller | None:
        """Return the owner of the token in the header Authorization, or None; raises `BadTokens`."""
        self.read()
        digest, owner = _digest(_token_of(authorization)).encode(), None
        for known, caller in self.callers:  # all of them: the time of the answer tells nothing about the token
            if hmac.compare_digest(known, digest):
                owner = caller
        return owner

    def read(self) -> None:
        """Read the file if it has changed; raises `BadTokens`."""
        try:
            status = self.path.stat()
            version = status.st_mtime_ns, status.st_size, status.st_ino
            if version != self.version:
                self.callers, self.version = _callers(self.path.read_text()), version
        except (OSError, UnicodeDecodeError) as error:
            raise BadTokens(f"The token file '{self.path}' cannot be read ({error})",
                            "Set SLIPSTICK_TOKENS to the token file") from error


def tokens_of(settings: Settings) -> Tokens | None:
    """Return the tokens of the service, or None if everybody who reaches it may do everything.

    Raises `BadTokens` for an invalid file, and for an address beyond this machine without one.
    """
    if isinstance(settings.tokens, Path):
        tokens = Tokens(settings.tokens)
        tokens.read()
        return tokens
    if settings.tokens is None and not _is_loopback(settings.host):
        raise BadTokens(f"The service would listen on '{settings.host}' without tokens",
                        "Set SLIPSTICK_TOKENS to a token file (`slipstick token NAME ROLE` makes its lines), "
                        "or to `off` if a proxy in front of the service authenticates")
    return None


def _callers(text: str) -> list[tuple[bytes, Caller]]:
    callers = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        parts = _LINE.fullmatch(line.strip())
        if parts is None:  # the line itself is not quoted: it may hold a token by mistake
            raise BadTokens(f"Line {number} of the token file is not NAME ROLE DIGEST", _REMEDY)
        role = next(role for role in ROLES if role == parts["role"])
        callers.append((parts["digest"].encode(), Caller(parts["name"], role)))
    return callers


def _token_of(authorization: str) -> str:
    """The token: after `Bearer`, or the password after `Basic`, which browsers ask for and send by themselves."""
    scheme, _, credentials = authorization.partition(" ")
    if scheme.lower() == "basic":
        try:
            return base64.b64decode(credentials, validate=True).decode().partition(":")[2]
        except (binascii.Error, UnicodeDecodeError):
            return ""
    return credentials.strip() if scheme.lower() == "bearer" else ""


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).hexdigest()


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"

"""A model of an UM-Bridge 1.0 server as simulator."""

import html
import http.client
import json
import re
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

import numpy as np

from slipstick.black_box.cases import Cases
from slipstick.black_box.function import NoResult
from slipstick.errors import InvalidValue

_PAUSES = (0.5, 2.0, 5.0)  # s before each further attempt to reach the server
_LARGEST = 64 << 20  # bytes of an answer
_EXCERPT = 100  # characters of the beginning and of the end of what an answer says
_NO_NUMBER = re.compile(r"(?i)(?<=[\[,:\s])[-+]?(nan|inf(inity)?)(?=[\],}\s])")


@dataclass(frozen=True)
class Bridge:
    """The model `model` of the server at `url`.

    `arguments` names the entries of each input vector, inputs and columns of the conditions. If it names a column, the
    model is evaluated once per condition and returns one number; otherwise it returns one number for each condition.
    `config` is sent with every request. A request that takes more than `timeout` s fails.
    """

    url: str
    model: str
    arguments: tuple[tuple[str, ...], ...]
    config: Mapping[str, Any] = field(hash=False)
    timeout: float

    def __post_init__(self) -> None:
        """Refuse other addresses than those of web servers."""
        if not self.url.startswith(("http://", "https://")):
            raise InvalidValue(f"'{self.url[:100]}' is not the URL of a server",
                               "Write a URL such as http://127.0.0.1:4242")

    @property
    def identity(self) -> str:
        """Model, arguments and config; the address of the server may change."""
        return f"UM-Bridge model {self.model}, arguments {json.dumps(self.arguments)}, " \
               f"config {json.dumps(dict(self.config), sort_keys=True)}"

    def run(self, inputs: Mapping[str, float], cases: Cases) -> list[float | NoResult]:
        """The output under each of the n conditions, NaN where there is none; raises `InvalidValue`."""
        names = [quantity.name for quantity in cases.quantities]
        if not any(name in names for vector in self.arguments for name in vector):
            return self._evaluate(inputs, len(cases))
        return [self._evaluate({**inputs, **dict(zip(names, row.tolist(), strict=True))}, 1)[0]
                for row in cases.values]

    def _evaluate(self, values: Mapping[str, float], count: int) -> list[float | NoResult]:
        body = {"name": self.model, "config": dict(self.config),
                "input": [[values[name] for name in vector] for vector in self.arguments]}
        try:
            numbers = self._request("Evaluate", body).numbers()
        except TimeoutError:
            return [NoResult(f"no answer within {self.timeout:g} s")] * count
        except NoResult as failure:
            return [failure] * count
        if len(numbers) != count:
            return [NoResult(f"the model '{self.model}' returned {len(numbers)} numbers where {count} are needed: name "
                             "the columns of the conditions in `arguments` for a model of one output, or omit them for "
                             "a model with an output for every condition")] * count
        return [*numbers]

    def _request(self, operation: str, body: Mapping[str, Any]) -> "_Answer":
        request = urllib.request.Request(f"{self.url}/{operation}", json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        for pause in (*_PAUSES, None):
            try:
                answer = _send(request, self.timeout)
                if answer.status != HTTPStatus.SERVICE_UNAVAILABLE:
                    return answer
                reason = answer.described
            except TimeoutError:
                raise
            except (OSError, http.client.HTTPException) as error:
                if isinstance(getattr(error, "reason", None), TimeoutError):
                    raise TimeoutError from error
                reason = str(getattr(error, "reason", error)) or type(error).__name__
            if pause is not None:
                time.sleep(pause)
        raise InvalidValue(f"The UM-Bridge server {self.url} cannot be reached: {reason}",
                           "Start the server, check `url`, and run the same command again: it resumes")


@dataclass(frozen=True)
class _Answer:
    """An answer of a server, whatever it says: status, its phrase, and body."""

    status: int
    phrase: str
    body: str

    def numbers(self) -> list[float]:
        """The numbers of all output vectors, NaN for a missing one; raises `NoResult`."""
        content = self._content()
        if isinstance(content, dict) and isinstance(content.get("error"), dict):
            error = content["error"]
            raise NoResult(f"status {self.status}: {error.get('type', 'error')}: {_excerpt(str(error.get('message')))}")
        if self.status != HTTPStatus.OK:
            raise NoResult(self.described)
        try:
            return [np.nan if value is None else float(value) for vector in content["output"] for value in vector]
        except (ValueError, TypeError, KeyError):
            raise NoResult(f"no output of UM-Bridge, such as {{\"output\": [[1.5]]}}, but {self.described}") from None

    @property
    def described(self) -> str:
        """The status and what the body says, in one line."""
        visible = html.unescape(re.sub(r"(?is)<(script|style|head)\b.*?</\1>|<[^>]*>", " ", self.body))
        text = _excerpt(visible.strip().removeprefix(str(self.status)).lstrip(" :"))
        return f"status {self.status}: {text or f'{self.phrase} (empty body)'}"

    def _content(self) -> Any:
        """The body as JSON, None if it is not."""
        # Servers in Python write NaN, some of them as the language prints it: nan, inf.
        for text in (self.body, _NO_NUMBER.sub("NaN", self.body)):
            with suppress(ValueError):
                return json.loads(text)
        return None


def _send(request: urllib.request.Request, timeout: float) -> _Answer:
    try:
        response = urllib.request.urlopen(request, timeout=timeout)
    except urllib.error.HTTPError as error:  # an answer too
        response = error
    with response:
        return _Answer(response.status, response.reason or "", response.read(_LARGEST).decode(errors="replace"))


def _excerpt(text: str) -> str:
    """The text in one line; of a long one the beginning and the end, where a traceback has its cause."""
    line = " ".join(text.split())
    return line if len(line) <= 2 * _EXCERPT else f"{line[:_EXCERPT]} ... {line[-_EXCERPT:]}"

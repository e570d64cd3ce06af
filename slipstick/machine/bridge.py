"""A model of an UM-Bridge 1.0 server as simulator."""

import json
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.machine.cases import Cases
from slipstick.machine.function import NoResult

_PAUSES = (0.5, 2.0, 5.0)  # s before each further attempt to reach the server
_LARGEST = 64 << 20  # bytes of an answer


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
            answer = self._request("Evaluate", body)
            if "error" in answer:
                return [NoResult(f"{answer['error']['type']}: {answer['error']['message']}")] * count
            numbers = [np.nan if value is None else float(value) for vector in answer["output"] for value in vector]
        except TimeoutError:
            return [NoResult(f"no answer within {self.timeout:g} s")] * count
        except (ValueError, TypeError, KeyError) as error:
            return [NoResult(f"the answer is no output of UM-Bridge ({type(error).__name__}: {error})")] * count
        if len(numbers) != count:
            raise InvalidValue(f"The model '{self.model}' returned {len(numbers)} numbers where {count} are needed",
                               "Name the columns of the conditions in `arguments` for a model of one output, or omit "
                               "them for a model with an output for every condition")
        return [*numbers]

    def _request(self, operation: str, body: Mapping[str, Any]) -> dict[str, Any]:
        request = urllib.request.Request(f"{self.url}/{operation}", json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        for pause in (*_PAUSES, None):
            try:
                with urllib.request.urlopen(request, timeout=self.timeout) as response:
                    content: dict[str, Any] = json.loads(response.read(_LARGEST))
                    return content
            except urllib.error.HTTPError as error:
                if error.code != 503:  # busy: try again
                    return dict(json.loads(error.read(_LARGEST)))
                reason = str(error)
            except TimeoutError:
                raise
            except (urllib.error.URLError, OSError) as error:
                if isinstance(getattr(error, "reason", None), TimeoutError):
                    raise TimeoutError from error
                reason = str(getattr(error, "reason", error))
            if pause is not None:
                time.sleep(pause)
        raise InvalidValue(f"The UM-Bridge server {self.url} cannot be reached: {reason}",
                           "Start the server, check `url`, and run the same command again: it resumes")

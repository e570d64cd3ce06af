"""The log of the service on standard error: one JSON object for each line, or text."""

import datetime
import logging
import sys
from typing import Any, Literal

import orjson

from . import request_ids

LogFormat = Literal["json", "text"]
ACCESS = logging.getLogger("slipstick.access")
"""Has one entry for each request."""


def log_format() -> LogFormat:
    """Return the form for those who read standard error: text for people at a terminal, JSON for programs."""
    return "text" if sys.stderr.isatty() else "json"


def log_config(form: LogFormat) -> dict[str, Any]:
    """Return the configuration of the loggers of the server and of the service."""
    formatter = {"()": f"{__name__}.JsonLines" if form == "json" else f"{__name__}.Text"}
    loggers = {name: {"handlers": ["log"], "level": "INFO", "propagate": False} for name in ("uvicorn", "slipstick")}
    return {"version": 1, "disable_existing_loggers": False, "formatters": {"line": formatter}, "loggers": loggers,
            "handlers": {"log": {"class": "logging.StreamHandler", "formatter": "line", "stream": "ext://sys.stderr"}}}


class JsonLines(logging.Formatter):
    """Time, level, logger, message, id of the request, what the entry has in `fields`, and the traceback of an error.
    """

    def format(self, record: logging.LogRecord) -> str:
        """Return the entry as JSON in one line."""
        entry = {"time": _time(record), "level": record.levelname.lower(), "logger": record.name,
                 "message": record.getMessage(), **getattr(record, "fields", {})}
        if request_ids.current.get():
            entry["request_id"] = request_ids.current.get()
        if record.exc_info:
            entry["traceback"] = self.formatException(record.exc_info)
        return orjson.dumps(entry, default=str).decode()


class Text(logging.Formatter):
    """The same as text for people; line breaks in a message are escaped, those of a traceback are not."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the entry as text."""
        message = record.getMessage().replace("\r", "\\r").replace("\n", "\\n")
        fields = getattr(record, "fields", {})
        client = f"{fields['client']} " if fields else ""
        seconds = f" {1e3 * fields['seconds']:.0f} ms" if fields else ""
        id = f" [{request_ids.current.get()}]" if request_ids.current.get() else ""
        traceback = f"\n{self.formatException(record.exc_info)}" if record.exc_info else ""
        return f"{_time(record)} {record.levelname:7} {client}{message}{seconds}{id}{traceback}"


def _time(record: logging.LogRecord) -> str:
    return datetime.datetime.fromtimestamp(record.created, datetime.UTC).isoformat(timespec="milliseconds")

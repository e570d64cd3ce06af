"""Selections and counts that the job database makes itself, instead of the service from thousands of its rows.

They read `workflow_status` and `workflow_input`, which the documentation of DBOS describes among its system tables.
"""

from dataclasses import dataclass
from typing import Any, TypeVarTuple

import sqlalchemy as sa
from sqlalchemy.dialects.postgresql import JSONB

from .job_filter import JobFilter

_SCHEMA = "dbos"
_TABLES = sa.MetaData(schema=_SCHEMA)
_JOB = sa.Table("workflow_status", _TABLES, *(sa.Column(name, sa.Text) for name in (
    "workflow_uuid", "name", "status", "queue_name", "application_name")), sa.Column("created_at", sa.BigInteger)).c
_INPUT = sa.Table("workflow_input", _TABLES, sa.Column("workflow_uuid", sa.Text), sa.Column("inputs", sa.Text)).c
_FILES = ("recordings", "table", "bench", "machine", "name")
"""Entries of the input of a job that name what it is of."""
_Columns = TypeVarTuple("_Columns")


@dataclass(frozen=True, eq=False)
class JobTable:
    """The jobs of the application `application` in the database of `engine`, and those of no application."""

    engine: sa.Engine
    application: str

    def count(self, workflow: str, wanted: JobFilter) -> int:
        """Return the number of wanted jobs of a kind."""
        with self._connect() as connection:
            return int(connection.execute(self._select(sa.select(sa.func.count()), workflow, wanted)).scalar_one())

    def newest(self, workflow: str, wanted: JobFilter, limit: int, offset: int) -> list[str]:
        """Return the ids of wanted jobs of a kind, newest first."""
        query = self._select(sa.select(_JOB.workflow_uuid), workflow, wanted)
        ordered = query.order_by(_JOB.created_at.desc(), self._among_equals.desc())
        with self._connect() as connection:
            return list(connection.execute(ordered.limit(limit).offset(offset)).scalars())

    def states(self, *among: str) -> list[tuple[str, str, str | None, int]]:
        """Return kind, state, queue and number of the jobs with equal ones, only `among` these states if given."""
        groups = (_JOB.name, _JOB.status, _JOB.queue_name)
        query = sa.select(*groups, sa.func.count()).where(self._is_own).group_by(*groups)
        if among:
            query = query.where(_JOB.status.in_(among))
        with self._connect() as connection:
            return [(name, state, queue, count) for name, state, queue, count in connection.execute(query)]

    def ahead(self, id: str, queue: str, submitted: int) -> int:
        """Return the number of jobs that wait in a queue before the job `id`, which was `submitted` at a time in ms."""
        own = sa.select(self._among_equals).where(_JOB.workflow_uuid == id).scalar_subquery()
        before = sa.or_(_JOB.created_at < submitted, sa.and_(_JOB.created_at == submitted, self._among_equals < own))
        query = sa.select(sa.func.count()).where(self._is_own, _JOB.queue_name == queue, _JOB.status == "ENQUEUED",
                                                 before)
        with self._connect() as connection:
            return int(connection.execute(query).scalar_one())

    def _select(self, query: sa.Select[*_Columns], workflow: str, wanted: JobFilter) -> sa.Select[*_Columns]:
        query = query.where(self._is_own, _JOB.name == workflow)
        if any("\0" in text for text in (wanted.text or "", *wanted.inputs.values())):
            return query.where(sa.false())  # a server refuses such texts, and no job has one
        if wanted.states is not None:
            query = query.where(_JOB.status.in_(wanted.states))
        if wanted.since is not None:
            query = query.where(_JOB.created_at >= round(1000 * wanted.since.timestamp()))
        if wanted.inputs or wanted.text:
            query = query.where(_INPUT.workflow_uuid == _JOB.workflow_uuid,
                                *(self._input(name) == value for name, value in wanted.inputs.items()))
        if wanted.text:
            texts = (_JOB.workflow_uuid, *map(self._input, _FILES))
            query = query.where(sa.or_(*(text.icontains(wanted.text, autoescape=True) for text in texts)))
        return query

    def _input(self, name: str) -> sa.ColumnElement[str]:
        """The entry `name` of the object with which a job was submitted."""
        if self._is_server:
            return sa.func.jsonb_extract_path_text(sa.cast(_INPUT.inputs, JSONB), "positionalArgs", "0", name)
        return sa.func.json_extract(_INPUT.inputs, f"$.positionalArgs[0].{name}")

    @property
    def _is_own(self) -> sa.ColumnElement[bool]:
        return sa.or_(_JOB.application_name == self.application, _JOB.application_name.is_(None))

    @property
    def _among_equals(self) -> sa.ColumnElement[Any]:
        """What orders jobs of the same time, which is that of whole seconds in SQLite."""
        return _JOB.workflow_uuid if self._is_server else sa.literal_column("workflow_status.rowid")

    @property
    def _is_server(self) -> bool:
        return self.engine.dialect.name == "postgresql"

    def _connect(self) -> sa.Connection:
        schema = _SCHEMA if self._is_server else None  # SQLite has no schemas
        return self.engine.connect().execution_options(schema_translate_map={_SCHEMA: schema})

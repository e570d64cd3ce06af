"""Metrics for Prometheus: requests as they are answered, jobs, workers and places when they are asked for."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from prometheus_client import CollectorRegistry, Histogram, ProcessCollector, generate_latest
from prometheus_client import Counter as Count
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from slipstick.storage.queues import QUEUES

from .computations import Computations
from .following import Following
from .heartbeats import Heartbeats
from .job_filter import STATUS
from .job_store import KINDS
from .job_table import JobTable

_SECONDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300)
_METHODS = ("GET", "HEAD", "POST", "PATCH", "DELETE", "OPTIONS")


class RequestMetrics:
    """Numbers and durations of the requests of one application."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.requests = Count("slipstick_requests", "Requests by method, route and status of the response; status 0 is "
                              "a connection that ended before it", ("method", "route", "status"),
                              registry=self.registry)
        self.seconds = Histogram("slipstick_request_seconds", "Time from the headers of a request to the end of its "
                                 "response in s", ("route",), buckets=_SECONDS, registry=self.registry)
        ProcessCollector(registry=self.registry)

    def count(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request. Labels have few values, whatever clients send."""
        self.requests.labels(method if method in _METHODS else "other", route, str(status)).inc()
        self.seconds.labels(route).observe(seconds)

    def text(self) -> bytes:
        """Return all metrics in the text format of Prometheus."""
        return generate_latest(self.registry)


@dataclass(frozen=True, eq=False)
class StateMetrics(Collector):
    """What is read when the metrics are asked for: the job database, and who computes and waits."""

    table: JobTable
    heartbeats: Heartbeats
    computations: Computations
    following: Following

    def collect(self) -> Iterator[Metric]:
        """Return the metrics; without job database those of the jobs are missing, and `slipstick_jobs_up` is 0."""
        yield _gauge("slipstick_computations_running", "Requests that compute", self.computations.running)
        yield _gauge("slipstick_computations_limit", "Requests that may compute at once", self.computations.most)
        yield _gauge("slipstick_computations_waiting", "Requests that wait to compute", self.computations.waiting)
        yield _gauge("slipstick_followers", "Clients that wait for jobs", self.following.count)
        try:
            yield from [*self._jobs(), _gauge("slipstick_jobs_up", "Whether the job database responds", 1)]
        except SQLAlchemyError:
            yield _gauge("slipstick_jobs_up", "Whether the job database responds", 0)

    def _jobs(self) -> Iterator[Metric]:
        jobs = GaugeMetricFamily("slipstick_jobs", "Jobs by kind and status", labels=("kind", "status"))
        counts: Counter[tuple[str, str]] = Counter()
        queues: Counter[str] = Counter({**dict.fromkeys(QUEUES, 0), "machine": 0})
        for kind, state, queue, number in self.table.states():
            counts[kind, STATUS[state]] += number
            if STATUS[state] == "queued" and queue:
                queues[queue if queue in QUEUES else "machine"] += number
        for kind in KINDS:
            for status in dict.fromkeys(STATUS.values()):
                jobs.add_metric((kind, status), counts[kind, status])
        waiting = GaugeMetricFamily("slipstick_queue_jobs", "Jobs that wait in each queue", labels=("queue",))
        for queue, count in queues.items():
            waiting.add_metric((queue,), count)
        yield from (jobs, waiting)
        yield _gauge("slipstick_workers", "Workers that are alive", self.heartbeats.alive())


def _gauge(name: str, meaning: str, value: float) -> Metric:
    return GaugeMetricFamily(name, meaning, value=value)

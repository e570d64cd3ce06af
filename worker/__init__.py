"""Offline commands for tables, calibrations and studies, and the worker that runs the jobs submitted to the service."""

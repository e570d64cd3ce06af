"""The REST service: tables, recordings, uncertainty propagation, likelihood, and jobs."""

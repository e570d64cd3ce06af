"""The REST service: tables, recordings, uncertainty propagation, likelihood, fits and studies."""

"""The online half: tables, recordings, propagation, likelihood, fits and studies over REST."""

"""The online half: tables, recordings, propagation, likelihood and fits over REST."""

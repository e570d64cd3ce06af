"""UM-Bridge 1.0: tables, and tables with recordings, as models for the samplers and optimizers of others."""

"""The offline half: builds and verifies tables, calibrates, and runs the fits that the service takes in."""

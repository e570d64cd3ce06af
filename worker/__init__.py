"""The offline half: builds and verifies tables, calibrates, studies, and runs the jobs that the service takes in."""

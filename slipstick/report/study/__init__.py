"""The report of a study: its content as parts, the page, and the comparison of fits on the tables of both models."""

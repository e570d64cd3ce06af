"""Evidence: how often a study is right, on cases that are drawn and not stored; see README.md."""

"""Side-by-side runs against peers; the results are the committed tables in this folder."""

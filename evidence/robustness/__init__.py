"""Robustness of service, worker and readers: what survives damage, kills, load and many jobs.

Each module is a command that replaces its rows of `evidence/robustness.csv`:

- `python -m evidence.robustness.damaged_tables` (a minute): 1,000 damaged HDF5 files, uploaded as tables.
- `python -m evidence.robustness.foreign_files CLONES` (seconds): files of data-acquisition systems that other programs
  wrote, from public repositories.
- `python -m evidence.robustness.kills` (ten minutes; needs PostgreSQL): SIGKILL for service, workers, database and
  builds while jobs run.
- `python -m evidence.robustness.load` (six minutes; needs an otherwise idle machine): 64 clients that mix everything.
- `python -m evidence.robustness.many_jobs` (a minute): lists, pages and metrics with 10,000 jobs in the store.
- `python -m evidence.robustness.reader_fuzz` (two minutes): drawn files of data-acquisition systems, valid and damaged.
- `python -m evidence.robustness.noise` (three minutes): the noise of sensors, as a study estimates it, on drawn cases.

A row counts `cases` and how many of them went `right`: damaged files that were refused with cause and remedy or read
without any difference, channels that were read, valid files that were read as they are, damaged ones that were not
read wrongly without a word, jobs that exist once with the result of an undisturbed run, requests
without an error, and cases in which the estimated noise is about right. `supervised` is the service with its workers
and database, `table` the table.
"""

"""How often intervals contain the true value, and whether predictions are calibrated, on simulated recordings.

    python -m evidence.calibration_coverage [calibrations|fits|coefficients] [--sets N]

- `calibrations` (ten minutes): means of the parameters of a bench, and those without a signal.
- `fits` (ten minutes; needs the table `nominal` of `make demo`): inputs fitted to shifting times, and predicted times.
- `coefficients` (three minutes): coefficients of the effects that whole studies give.

Each of these is a module with the number of its `SETS`, its jobs (`list_jobs`), their work (`run_job`), and the rows of
its results (`make_rows`). Jobs that are done are lines of var/evidence/coverage-*.jsonl, so that a killed run goes on
where it was.

The rows go to evidence/calibration_coverage.csv: `hits` of the `intervals` of so many simulated `sets` contain the true
value. `lower` and `upper` are 95 % bounds of the share. They take intervals for independent, which those of the same
set are not quite.
"""

# One image for the service, the worker and the offline commands (see docker-compose.yml).

FROM python:3.11-slim AS packages
WORKDIR /build
COPY pyproject.toml ./
RUN python -c "import tomllib; project = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
    extras = project['optional-dependencies']; \
    print(*project['dependencies'], *extras['dask'], *extras['mdf'], *extras['parquet'], sep='\n')" > requirements.txt \
    && python -m venv /packages \
    && /packages/bin/pip install --no-cache-dir -r requirements.txt

FROM python:3.11-slim
RUN useradd --system --create-home slipstick && install -d -o slipstick -g slipstick /data /data/tables
COPY --from=packages /packages /packages
WORKDIR /app
COPY slipstick ./slipstick
COPY worker ./worker
COPY service ./service
# Otherwise every start compiles all modules, because the user of the image may not write beside them.
RUN python -m compileall -q slipstick worker service
# A new named volume mounted on /data is initialised with this content and its owner.
COPY --chown=slipstick:slipstick tables/measured.h5 /data/tables/
COPY --chown=slipstick:slipstick tables/heavy.toml /data/tables/
COPY --chown=slipstick:slipstick tables/compact.toml /data/tables/
USER slipstick
# The volume keeps the machine code, which is compiled again on another processor or after an update.
ENV PATH=/packages/bin:$PATH PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/data/cache
RUN python -m worker.rehearsal
CMD ["python", "-m", "service"]

# One image for the service, the worker and all other commands (see docker-compose.yml).

FROM python:3.11-slim AS packages
WORKDIR /build
COPY pyproject.toml ./
# The dependencies are a layer of their own, which a change of the source leaves as it is.
RUN python -c "import tomllib; project = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
    extras = [project['optional-dependencies'][name] for name in ('dask', 'fmu', 'mdf', 'parquet', 'reports', 'service')]; \
    print(*project['dependencies'], *sum(extras, []), sep='\n')" > requirements.txt \
    && python -m venv /packages \
    && /packages/bin/pip install --no-cache-dir -r requirements.txt
COPY LICENSE NOTICES.md README.md ./
COPY slipstick ./slipstick
COPY service ./service
COPY worker ./worker
COPY tables/compact.toml tables/heavy.toml tables/sample.h5 ./tables/
COPY tables/machines ./tables/machines
RUN /packages/bin/pip install --no-cache-dir --no-deps .

FROM python:3.11-slim
RUN useradd --system --create-home slipstick && install -d -o slipstick -g slipstick /data /data/tables
COPY --from=packages /packages /packages
# A new named volume mounted on /data is initialised with this content and its owner.
COPY --chown=slipstick:slipstick tables/measured.h5 tables/heavy.toml tables/compact.toml /data/tables/
USER slipstick
WORKDIR /data
# The volume keeps the machine code, which is compiled again on another processor or after an update.
ENV PATH=/packages/bin:$PATH PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/data/cache
RUN python -m slipstick_worker.rehearsal
CMD ["python", "-m", "slipstick_service"]

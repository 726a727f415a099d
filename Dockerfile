# pidcfg in a container: docker build -t pidcfg . && docker run --rm -v "$PWD:/work" pidcfg validate .
# A tag moves: --build-arg BASE=python:3.13-slim@sha256:... builds from one image for good.
ARG BASE=python:3.13-slim
FROM ${BASE} AS build
WORKDIR /src
COPY requirements/build.txt requirements/run.txt requirements/
RUN python -m venv /opt/build \
    && /opt/build/bin/pip install --no-cache-dir --require-hashes -r requirements/build.txt \
    && python -m venv --without-pip /opt/pidcfg \
    && /opt/build/bin/pip --python /opt/pidcfg install --no-cache-dir --require-hashes -r requirements/run.txt
COPY LICENSE README.md pyproject.toml ./
COPY docs/man docs/man
COPY requirements/pidcfg.cdx.json requirements/
COPY tools/release/metadata.py tools/release/
COPY src src
RUN /opt/build/bin/pip wheel --no-cache-dir --no-deps --no-build-isolation --wheel-dir /wheels . \
    && /opt/build/bin/pip --python /opt/pidcfg install --no-cache-dir --no-deps --no-index --find-links /wheels pidcfg

FROM ${BASE}
LABEL org.opencontainers.image.title="pidcfg" \
      org.opencontainers.image.description="Check, encode and simulate the PID loops of small PLCs, written as YAML" \
      org.opencontainers.image.licenses="MIT" \
      org.opencontainers.image.version="0.2.0"
COPY --from=build /opt/pidcfg /opt/pidcfg
ENV PATH=/opt/pidcfg/bin:$PATH
# Nobody in particular: name yourself with --user "$(id -u):$(id -g)" where the container has to write.
USER 10001:10001
WORKDIR /work
ENTRYPOINT ["pidcfg"]
CMD ["--help"]

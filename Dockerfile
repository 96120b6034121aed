# chefbot in a container, on x86-64 and aarch64:
#
#   docker build -t chefbot .
#   docker run --rm -it -v chefbot:/var/lib/chefbot chefbot demo --headless
#
# A built robot needs its devices; with the host's network, RViz, phones and other robots find it. See docs/built_robot.md.
FROM python:3.11-slim-bookworm AS build
RUN apt-get update \
    && apt-get install -y --no-install-recommends g++ \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY requirements.lock requirements-build.lock ./
RUN python -m venv /opt/chefbot \
    && /opt/chefbot/bin/pip install --no-cache-dir --require-hashes -r requirements.lock \
    && /opt/chefbot/bin/pip install --no-cache-dir --require-hashes -r requirements-build.lock
COPY . .
RUN /opt/chefbot/bin/pip install --no-cache-dir --no-deps --no-build-isolation .

FROM python:3.11-slim-bookworm
COPY --from=build /opt/chefbot /opt/chefbot
# Serial ports and USB cameras belong to these groups; kernels are compiled once, into the volume.
RUN useradd --groups dialout,plugdev,video --home-dir /var/lib/chefbot --create-home chefbot
ENV PATH=/opt/chefbot/bin:$PATH \
    CHEFBOT_STATE=/var/lib/chefbot/state \
    XDG_CACHE_HOME=/var/lib/chefbot/cache \
    NUMBA_CACHE_DIR=/var/lib/chefbot/cache/kernels
USER chefbot
WORKDIR /var/lib/chefbot
VOLUME /var/lib/chefbot
EXPOSE 8080
ENTRYPOINT ["chefbot"]
CMD ["--help"]

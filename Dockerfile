# Images of Cellwright, 350 MiB without ROS and 541 MiB with ROS 1, uncompressed on x86-64.
# The plain one has no compiled Python files (12 MiB): each start takes about a second longer. For OpenGL see docs/video.md.
#
#   docker build --target plain -t cellwright .
#   docker build --target ros -t cellwright:ros .
#   docker run --rm -v "$PWD:/work" cellwright run trial.yaml --no-picture
#
# The user in the image is number 1000. Where yours has another number, add --user "$(id -u):$(id -g)".

FROM debian:12-slim AS base
RUN apt-get update && apt-get install --yes --no-install-recommends python3 && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/debconf/*-old /var/log/* \
    && find /usr/lib/python3* -name __pycache__ -exec rm -r {} +

FROM base AS build
RUN apt-get update && apt-get install --yes --no-install-recommends binutils make python3-venv
WORKDIR /opt/cellwright
COPY LICENSE Makefile README.md pyproject.toml ./
COPY src src
RUN make .venv/.installed SOURCE="'.[video]'"
# What no run needs, 115 MB: debug symbols, tests, headers, sources of compiled files, libraries of Windows, pip.
# Libraries in *.libs are left as they are: strip would break them.
RUN .venv/bin/pip uninstall --quiet --yes setuptools pip \
    && find .venv -name '*.so' -not -path '*.libs/*' -exec strip --strip-unneeded {} + \
    && find .venv -depth -type d \( -name tests -o -name testdata -o -name include -o -name DLLS \
        -o -path '*/mujoco/doc' -o -path '*/viser/client/src' \
        -o -path '*/mpl-data/sample_data' -o -path '*/mpl-data/fonts/afm' -o -path '*/mpl-data/fonts/pdfcorefonts' \) -exec rm -r {} + \
    && find .venv \( -name '*.pyi' -o -name '*.pyx' -o -name '*.pxd' -o -name '*_test.py' -o -name '*.a' \) -delete

FROM base AS plain
RUN useradd --uid 1000 --create-home cellwright && install --directory --owner=1000 --group=1000 --mode=1777 /work
COPY --from=build /opt/cellwright/.venv /opt/cellwright/.venv
ENV PATH=/opt/cellwright/.venv/bin:$PATH
WORKDIR /work
USER cellwright
ENTRYPOINT ["cellwright"]

FROM plain AS ros
USER root
COPY scripts /opt/cellwright/scripts
# python3-tf2-ros depends on headers and a compiler's libraries, and rosbash on cmake. No run needs their files.
RUN printf 'path-exclude %s\n' '/usr/include/*' '/usr/lib/*.a' '/usr/lib/gcc/*' '/usr/lib/*/lib[at]san.*' \
        /usr/bin/cmake /usr/bin/cpack /usr/bin/ctest '/usr/share/cmake*' '/usr/share/doc/*-dev/*' \
        >/etc/dpkg/dpkg.cfg.d/no-build \
    && CI=true PATH=/usr/sbin:/usr/bin:/sbin:/bin /opt/cellwright/scripts/install-ros1 --run && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/debconf/*-old /var/log/*
USER cellwright

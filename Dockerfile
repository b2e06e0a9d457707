# The demo in a container: docker build -t stereo_descriptor_vo . && docker run --rm stereo_descriptor_vo prints its table.
# The steps are those of scripts/bare_root and scripts/test_bare, which try them without Docker (test/check_dockerfile).
FROM debian:bookworm
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates git sudo
RUN useradd --create-home --shell /bin/bash user && echo "user ALL=(ALL) NOPASSWD: ALL" >/etc/sudoers.d/user
COPY --chown=user . /home/user/stereo_descriptor_vo
USER user
WORKDIR /home/user/stereo_descriptor_vo
# All that takes long once, while the image is made: the demo itself finds it done.
RUN scripts/install_dependencies && scripts/build stereo_descriptor_vo_demo
CMD ["scripts/demo"]

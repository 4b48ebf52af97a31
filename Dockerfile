# The command alone: docker build -t dmp . && docker run --rm -v "$PWD:/data" dmp score drive.mcap -t run.tum
FROM rust:1.95-slim-bookworm AS build
WORKDIR /src
COPY . .
RUN cargo build --release --locked && strip target/release/dmp

FROM debian:bookworm-slim
COPY --from=build /src/target/release/dmp /usr/local/bin/dmp
COPY --from=build /src/LICENSE-MIT /src/LICENSE-APACHE /src/THIRD-PARTY.txt /usr/share/doc/dmp/
WORKDIR /data
# Scores do not depend on who computes them: nobody in particular.
USER 65534:65534
ENTRYPOINT ["dmp"]
CMD ["--help"]

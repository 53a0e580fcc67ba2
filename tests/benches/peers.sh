#!/usr/bin/env bash
# Compares the control step with that of other libraries: tests/benches/peers.sh --json FILE
#
# Installs the other libraries below target/peers (Orocos KDL from Debian; CasADi, Pinocchio and DQ Robotics from PyPI), builds them with
# -O3 for any x86-64, checks that all give the same poses and Jacobians, and measures them interleaved. `--install` stops after the Python
# packages, which compare_peers.py needs too.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1-} ${2-}" in
    "--install ") ;;
    "--json "?*) json=$(realpath "$2") ;;
    *) echo "usage: tests/benches/peers.sh --json FILE | --install" >&2; exit 2 ;;
esac
folder=$PWD/target/peers
python=$folder/venv/bin/python
mkdir -p "$folder"
[ -x "$python" ] || python3 -m venv "$folder/venv"
"$python" -m pip install -q casadi==3.8.2 dqrobotics==26.4.0a7 jparse-robotics==0.1.0 numpy pin==4.1.0 pin-pink==4.4.0 quadprog==0.1.14 pyyaml scipy
[ "$1" = --json ] || exit 0

if ! [ -e /usr/include/kdl/chain.hpp ] || ! command -v g++ >/dev/null; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update -q
    $sudo apt-get install -qy g++ liborocos-kdl-dev
fi
sources=$PWD/tests/benches/peers
prefix=$("$python" -c 'import pathlib, pinocchio; print(next(p for p in pathlib.Path(pinocchio.__file__).parents if p.name == "cmeel.prefix"))')
build() { g++ -O3 -DNDEBUG -std=c++17 -I/usr/include/eigen3 -I"$folder" "$sources/$1.cpp" "${@:2}" -o "$folder/$1"; }
(cd "$folder" && "$python" "$sources/casadi_laws.py" && gcc -O3 -c laws.c)
build casadi "$folder/laws.o"
build kdl -lorocos-kdl
# Pinocchio has more kinds of joints than Boost's lists hold by default.
build pinocchio -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_MPL_LIMIT_LIST_SIZE=30 -I"$prefix/include" -L"$prefix/lib" -Wl,-rpath,"$prefix/lib" -lpinocchio_default
cargo bench --locked --bench peers --no-run
ours=$(cargo bench --locked --bench peers --no-run 2>&1 | sed -n 's/.*(\(.*\)).*/\1/p' | tail -1)

PEER_VERSIONS=$("$python" - "$(rustc --version)" "$(g++ --version | head -1)" "$(dpkg-query -W -f '${Version}' liborocos-kdl-dev)" <<'PYTHON'
import importlib.metadata, json, sys
versions = dict(zip(("rustc", "g++", "KDL"), sys.argv[1:]))
print(json.dumps(versions | {name: importlib.metadata.version(name) for name in ("casadi", "pin", "dqrobotics")}))
PYTHON
) "$python" "$sources/measure.py" "$json" \
    "ours=$ours ours" "ours, as twists=$ours twists" "CasADi, generated C=$folder/casadi" "Pinocchio, C++=$folder/pinocchio" \
    "Orocos KDL, C++=$folder/kdl" "nalgebra's dual quaternions=$ours nalgebra" "DQ Robotics, Python=$python $sources/dq_robotics.py"

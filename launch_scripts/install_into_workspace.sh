#!/bin/sh
# Installs dq_servo into a colcon workspace, like a package that `colcon build` installs:
#   launch_scripts/install_into_workspace.sh ~/ros2_ws
#   . ~/ros2_ws/install/setup.bash
#   ros2 launch dq_servo dq_servo.launch.py
#   ros2 run dq_servo dq_servo servo
# The workspace must have been built (`colcon build`, with or without packages in it). The program is $DQ_SERVO, or this checkout's
# release build, which is built if it is missing. Files of an earlier run are replaced.
set -eu
fail() {
    echo "error: $1" >&2
    exit 2
}
case ${1-} in
-h | --help)
    sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
    exit 0
    ;;
esac
[ $# = 1 ] || fail "one argument is expected, the folder of the workspace: see --help"
checkout=$(cd "$(dirname "$0")/.." && pwd)
install=$1/install
[ -f "$install/setup.sh" ] || fail "$install/setup.sh is not there: run 'colcon build' in the workspace first"
program=${DQ_SERVO:-$checkout/target/release/dq_servo}
if [ ! -x "$program" ]; then
    [ -z "${DQ_SERVO:-}" ] || fail "DQ_SERVO=$DQ_SERVO is no program"
    (cd "$checkout" && cargo build --release --locked)
fi

# colcon installs each package into its own folder, or all packages into one, and notes which.
case $(cat "$install/.colcon_install_layout" 2>/dev/null) in
merged) prefix=$install ;;
*) prefix=$install/dq_servo ;;
esac
share=$prefix/share/dq_servo
lib=$prefix/lib/dq_servo
rm -rf "$share" "$lib"
mkdir -p "$share/launch" "$share/rviz" "$lib" "$prefix/share/ament_index/resource_index/packages" "$prefix/share/colcon-core/packages"
cp "$program" "$lib/dq_servo"
cp "$checkout"/launch_scripts/*.launch.py "$share/launch"
cp "$checkout"/launch_scripts/*.rviz "$share/rviz"
cp -R "$checkout/msg_config" "$share"
# The ament index finds the package by the first file. colcon's setup scripts find it by the second, which lists the packages that it needs
# at run time: none.
: >"$prefix/share/ament_index/resource_index/packages/dq_servo"
: >"$prefix/share/colcon-core/packages/dq_servo"
# The setup scripts' actions for the package.
echo 'prepend-non-duplicate;AMENT_PREFIX_PATH;' >"$share/package.dsv"

field() {
    sed -n "s/^$1 = \"\(.*\)\"$/\1/p" "$checkout/Cargo.toml" | head -n 1 | sed 's/&/\&amp;/g; s/</\&lt;/g'
}
cat >"$share/package.xml" <<XML
<?xml version="1.0"?>
<package format="3">
  <name>dq_servo</name>
  <version>$(field version)</version>
  <description>$(field description)</description>
  <maintainer email="dq_servo@localhost">the authors of dq_servo</maintainer>
  <license>$(field license)</license>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>ros2launch</exec_depend>
  <export>
    <build_type>cargo</build_type>
  </export>
</package>
XML
echo "dq_servo $(field version) is installed in $prefix"

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
. "$checkout/launch_scripts/package_files.sh"
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
rm -rf "$share" "$prefix/lib/dq_servo"
copy_files "$program" "$prefix"
package_xml >"$share/package.xml"
mkdir -p "$prefix/share/ament_index/resource_index/packages" "$prefix/share/colcon-core/packages"
# The ament index finds the package by the first file. colcon's setup scripts find it by the second, which lists the packages that it needs
# at run time: none.
: >"$prefix/share/ament_index/resource_index/packages/dq_servo"
: >"$prefix/share/colcon-core/packages/dq_servo"
# The setup scripts' actions for the package.
echo 'prepend-non-duplicate;AMENT_PREFIX_PATH;' >"$share/package.dsv"
echo "dq_servo $(field version) is installed in $prefix"

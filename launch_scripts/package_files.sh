# For the scripts that install or pack dq_servo, which source it after setting `checkout`: its files, and what Cargo.toml says of it.

# Prints a field of Cargo.toml.
field() { # NAME
    sed -n "s/^$1 = \"\(.*\)\"$/\1/p" "$checkout/Cargo.toml" | head -n 1
}
maintainer="the authors of dq_servo"
# Each release names the owner's address, once there is one. The checks of ROS 2 need a domain.
address=dq_servo@example.org

# Copies the program, launch files, arms and the view for RViz below PREFIX.
copy_files() { # PROGRAM PREFIX
    mkdir -p "$2/lib/dq_servo" "$2/share/dq_servo/launch" "$2/share/dq_servo/rviz"
    cp "$1" "$2/lib/dq_servo/dq_servo"
    cp "$checkout"/launch_scripts/*.launch.py "$2/share/dq_servo/launch"
    cp "$checkout"/launch_scripts/*.rviz "$2/share/dq_servo/rviz"
    cp -R "$checkout/msg_config" "$2/share/dq_servo"
}

# Prints the manifest of the ROS 2 package.
package_xml() {
    escaped=$(field description | sed 's/&/\&amp;/g; s/</\&lt;/g')
    cat <<XML
<?xml version="1.0"?>
<package format="3">
  <name>dq_servo</name>
  <version>$(field version)</version>
  <description>$escaped</description>
  <maintainer email="$address">$maintainer</maintainer>
  <license>$(field license)</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <exec_depend>launch</exec_depend>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>ros2launch</exec_depend>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
XML
}

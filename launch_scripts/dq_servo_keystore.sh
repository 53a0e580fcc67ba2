#!/bin/sh
# Makes a keystore for running secured, laid out as sros2's, whose `ros2 security` can add to it:
#   launch_scripts/dq_servo_keystore.sh DIR [NAMESPACE]
# One authority, one governance (everything is authenticated and encrypted, in every domain), and an enclave for each node of ours in
# NAMESPACE (/ by default) that may do what that node does and no more. Nodes that are remapped need permissions of their own.
# What is there already stays, so another namespace can be added later; the authority's key in DIR/private makes all of it.
set -euf # a topic with a star is no file name
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
[ $# -ge 1 ] && [ $# -le 2 ] || fail "expected DIR [NAMESPACE]"
command -v openssl >/dev/null || fail "no openssl: install OpenSSL's command line first"
keystore=$1
namespace=${2:-/}
case $namespace in
/) namespace= ;;
*[!A-Za-z0-9_/]* | *//* | */) fail "namespace '$namespace': expected /, or names after slashes as in /cell/left" ;;
/*) ;;
*) fail "namespace '$namespace': expected a slash first" ;;
esac
umask 077
mkdir -p "$keystore/public" "$keystore/private" "$keystore/enclaves"
keystore=$(cd "$keystore" && pwd)
days=3650 # as sros2
log=$(mktemp)
trap 'rm -f "$log"' EXIT

# OpenSSL reports its progress on stderr; only a failure is worth reading.
run_openssl() {
    openssl "$@" 2>"$log" || {
        cat "$log" >&2
        fail "openssl $1 failed"
    }
}

sign() { # FILE.xml: writes FILE.p7s
    run_openssl smime -sign -text -md sha256 -in "$1" -out "${1%.xml}.p7s" \
        -signer "$keystore/public/ca.cert.pem" -inkey "$keystore/private/ca.key.pem"
}

new_key() { # FILE
    run_openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1"
}

if [ ! -e "$keystore/public/ca.cert.pem" ]; then
    new_key "$keystore/private/ca.key.pem"
    run_openssl req -x509 -new -sha256 -days "$days" -subj "/CN=dq_servo CA" \
        -key "$keystore/private/ca.key.pem" -out "$keystore/public/ca.cert.pem"
    for role in identity permissions; do
        ln -sf ca.cert.pem "$keystore/public/${role}_ca.cert.pem"
        ln -sf ca.key.pem "$keystore/private/${role}_ca.key.pem"
    done
fi

# As sros2 sets it by default, but for every domain, and without the third layer of encryption. What goes over the wire is
# encrypted and authenticated twice (AES-GCM): each RTPS message with its participant's key (rtps_protection_kind), and in it each
# submessage, payload included, with the key of its writer or reader, which only those get who may read or write that topic
# (metadata_protection_kind). data_protection_kind would encrypt the payload alone once more, inside of that, with a key that the
# same readers get: it hides nothing from anybody on the wire, only from who passes submessages on without being allowed to read
# them, of whom ROS 2 has none. With it (ENCRYPT or SIGN) RustDDS cannot read what Fast DDS sends, unless its length is a multiple
# of four: calls of services by ROS 2 nodes would hang.
if [ ! -e "$keystore/enclaves/governance.p7s" ]; then
    cat >"$keystore/enclaves/governance.xml" <<END
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>232</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
END
    sign "$keystore/enclaves/governance.xml"
fi

# What a node may do is gathered in two lists of DDS topics.
publishes() { for topic; do published="$published$topic "; done; }
subscribes() { for topic; do subscribed="$subscribed$topic "; done; }
serves() { # SERVICE...
    for service; do
        subscribes "rq${service}Request"
        publishes "rr${service}Reply"
    done
}
calls() { # SERVICE...
    for service; do
        publishes "rq${service}Request"
        subscribes "rr${service}Reply"
    done
}
parameter_services() { # NODE
    for service in describe_parameters get_parameter_types get_parameters list_parameters set_parameters set_parameters_atomically; do
        echo "$1/$service"
    done
}
any_node() { # NAME...: what rclcpp, rclpy and this program give each node, among it both ends of parameter changes and the clock
    publishes ros_discovery_info rt/rosout rt/parameter_events
    subscribes ros_discovery_info rt/parameter_events rt/clock
    for name; do
        # shellcheck disable=SC2046  # a list of names
        serves $(parameter_services "$name") "$name/get_type_description"
    done
}
operator() { # NAME: a command of this program, or ROS 2's command line, whose nodes are called _ros2cli_ and a number
    any_node "$1" '/_ros2cli_*'
}
sets_parameters() { # NODE
    # shellcheck disable=SC2046  # a list of names
    calls $(parameter_services "$1")
}

topics_xml() { # TOPIC...
    for topic; do echo "            <topic>$topic</topic>"; done
}
permissions_xml() { # ENCLAVE
    today=$(date -u +%Y-%m-%d)
    # shellcheck disable=SC2086  # lists of names
    cat <<END
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="$1">
      <subject_name>CN=$1</subject_name>
      <validity>
        <not_before>${today}T00:00:00</not_before>
        <not_after>$((${today%%-*} + 10))-01-01T00:00:00</not_after>
      </validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
        <publish>
          <topics>
$(topics_xml $published)
          </topics>
        </publish>
        <subscribe>
          <topics>
$(topics_xml $subscribed)
          </topics>
        </subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
END
}

enclave() { # ENCLAVE: with what was gathered for it
    folder=$keystore/enclaves$1
    if [ ! -e "$folder/permissions.p7s" ]; then
        mkdir -p "$folder"
        up=$(echo "$1" | sed 's|/[^/]*|../|g')
        for role in identity permissions; do
            ln -sf "${up}../public/${role}_ca.cert.pem" "$folder/${role}_ca.cert.pem"
        done
        ln -sf "${up}governance.p7s" "$folder/governance.p7s"
        new_key "$folder/key.pem"
        run_openssl req -new -sha256 -key "$folder/key.pem" -out "$folder/request.pem" \
            -subj "/CN=$(echo "$1" | sed 's|/|\\/|g')"
        echo "basicConstraints = critical, CA:FALSE" |
            run_openssl x509 -req -sha256 -days "$days" -in "$folder/request.pem" -out "$folder/cert.pem" \
                -set_serial "0x$(openssl rand -hex 8)" -extfile /dev/stdin \
                -CA "$keystore/public/ca.cert.pem" -CAkey "$keystore/private/ca.key.pem"
        rm "$folder/request.pem"
        permissions_xml "$1" >"$folder/permissions.xml"
        sign "$folder/permissions.xml"
        echo "enclave $1"
    fi
    published= subscribed=
}

published= subscribed=
servo=$namespace/dq_servo
dual=$namespace/dq_dual_servo
nodes="$servo $dual"
for place in "$namespace" "$namespace/left" "$namespace/right"; do
    nodes="$nodes $place/puma560 $place/arm $place/dq_servo_guard"
done
topics() { # PREFIX NAME...
    prefix=$1
    shift
    for topic; do echo "rt$prefix/$topic"; done
}
both_arms() { for topic; do topics "$namespace/left" "$topic" && topics "$namespace/right" "$topic"; done; }
plant_out="joint_states robot_description puma560/parameters arm/parameters"
servo_out="current_pose pose_error status motions parameters events"
pictures="markers path goal/update" # for RViz; a goal that is dragged there is sent by the servo
# Of what the parameter interface names.
command="forward_velocity_controller/commands forward_position_controller/commands joint_trajectory_controller/joint_trajectory"
speed_scaling="speed_scaling_state_broadcaster/speed_scaling"
guard_out="command_guard dq_servo_guard/parameters"

# shellcheck disable=SC2046,SC2086  # lists of names throughout
{
    may_servo() {
        any_node "$servo"
        serves "$servo/pause" "$servo/stop" "$servo/reconfigure" "$servo/goal/get_interactive_markers"
        publishes $(topics "$namespace" $command goal_pose) $(topics "$servo" $servo_out $pictures) rt/diagnostics
        subscribes $(topics "$namespace" goal_pose joint_states $speed_scaling command_guard robot_description) $(topics "$servo" goal/feedback target_twist) rt/clock rt/tf rt/tf_static
    }
    may_dual() {
        any_node "$dual"
        serves "$dual/pause" "$dual/stop" "$dual/reconfigure" "$dual/goal/get_interactive_markers"
        publishes $(both_arms $command) $(topics "$namespace" relative_goal) $(topics "$dual" $servo_out $pictures) rt/diagnostics
        subscribes $(topics "$namespace" relative_goal robot_description) $(both_arms joint_states $speed_scaling command_guard) $(topics "$dual" goal/feedback target_twist) rt/clock
    }
    may_plant() { # NAMESPACE: the built-in arm, or any other
        any_node "$1/puma560" "$1/arm"
        serves "$1/puma560/reset" "$1/arm/reset"
        publishes $(topics "$1" $plant_out) rt/tf rt/tf_static rt/diagnostics
        subscribes $(topics "$1" $command command_guard) rt/clock
    }
    may_guard() { # NAMESPACE
        any_node "$1/dq_servo_guard"
        publishes $(topics "$1" $command $guard_out)
        subscribes $(topics "$1" $command joint_states robot_description)
    }
    may_watch() { # every topic of every node of ours
        subscribes $(topics "$namespace" goal_pose relative_goal $command $plant_out $guard_out)
        subscribes $(both_arms $command $plant_out $guard_out)
        subscribes $(topics "$servo" $servo_out $pictures target_twist) $(topics "$dual" $servo_out $pictures target_twist)
        subscribes rt/diagnostics rt/tf rt/tf_static rt/rosout rt/clock
        for node in $nodes; do calls "$node/get_type_description"; done
    }
    may_call() { # stop, pause, resume, reconfigure, reset, status
        calls "$servo/pause" "$servo/stop" "$servo/reconfigure" "$dual/pause" "$dual/stop" "$dual/reconfigure"
        for place in "$namespace" "$namespace/left" "$namespace/right"; do
            calls "$place/puma560/reset" "$place/arm/reset" && sets_parameters "$place/puma560" && sets_parameters "$place/arm"
        done
        subscribes $(topics "$servo" status) $(topics "$dual" status)
    }
    may_send_goals() { publishes $(topics "$namespace" goal_pose relative_goal); }
    may_view() {
        may_send_goals
        for node in "$servo" "$dual"; do
            sets_parameters "$node"
            calls "$node/pause" "$node/stop"
            publishes $(topics "$node" target_twist)
            subscribes $(topics "$node" $servo_out)
        done
        for place in "$namespace" "$namespace/left" "$namespace/right"; do
            calls "$place/puma560/reset" "$place/arm/reset"
            subscribes $(topics "$place" joint_states)
        done
    }
    may_set_parameters() {
        # What is too long for a reply is announced.
        for node in $nodes; do sets_parameters "$node" && subscribes $(topics "$node" parameters); done
    }

    may_servo && enclave "$servo"
    may_dual && enclave "$dual"
    for place in "$namespace" "$namespace/left" "$namespace/right"; do
        may_plant "$place" && enclave "$place/puma560"
        may_plant "$place" && enclave "$place/arm"
        may_guard "$place" && enclave "$place/dq_servo_guard"
    done
    operator "$namespace/dq_servo_goal" && may_send_goals && may_watch && calls "$servo/stop" "$dual/stop" &&
        enclave "$namespace/dq_servo_goal"
    operator "$namespace/dq_servo_call" && may_call && enclave "$namespace/dq_servo_call"
    operator "$namespace/dq_servo_param" && may_set_parameters && enclave "$namespace/dq_servo_param"
    operator "$namespace/dq_servo_recorder" && may_watch && enclave "$namespace/dq_servo_recorder"
    # Its page records too.
    operator "$namespace/dq_servo_view" && may_view && may_watch && enclave "$namespace/dq_servo_view"
    # The demo is servo, plants, operator and view in one process.
    operator "$namespace/dq_servo_demo" && may_servo && may_dual && may_send_goals && may_watch && may_set_parameters && may_view
    for place in "$namespace" "$namespace/left" "$namespace/right"; do may_plant "$place"; done
    enclave "$namespace/dq_servo_demo"
}

#!/usr/bin/env bash
# Makes a keystore for a secured graph, with sros2's layout, so that `ros2 security` can extend it:
#   launch_scripts/dq_servo_keystore.sh DIR [NAMESPACE [ROS ARGUMENTS]]
# It has one authority, one governance (everything is authenticated and encrypted, in every domain), and an enclave for each node of this
# program in NAMESPACE (/ by default). An enclave permits only what its node does; the program prints that from its wire contract.
# If nodes are remapped, name their remaps: ... DIR / -r joint_states:=/robot/joint_states
# Existing files stay, so that you can add another namespace later. The key of the authority is in DIR/private: whoever has it can add nodes.
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -euo pipefail
. "$(dirname "$0")/parts.bash"
[ $# -ge 1 ] || mistake "expected DIR [NAMESPACE [ROS ARGUMENTS]]"
command -v openssl >/dev/null || mistake "no openssl: install OpenSSL's command line first"
keystore=$1
ros_args=(--ros-args -r "__ns:=${2:-/}" "${@:3}")
# Report a mistake in the namespace before anything is made.
enclaves=$("$program" permissions "${ros_args[@]}")
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
        mistake "openssl $1 failed"
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

# Like sros2's default, but for every domain, and without the third layer of encryption. Everything on the wire is encrypted and
# authenticated twice (AES-GCM). Each RTPS message is encrypted with its participant's key (rtps_protection_kind). In it, each submessage
# with its payload is encrypted with the key of its writer or reader, which only participants with permission for that topic get
# (metadata_protection_kind). data_protection_kind would encrypt the payload once more, with a key that the same readers get. It hides
# nothing on the wire, but only from relays of submessages without permission to read them, which ROS 2 does not have. With it (ENCRYPT or
# SIGN), RustDDS cannot read what Fast DDS sends unless its length is a multiple of four, so that service calls of ROS 2 nodes would hang.
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

for enclave in $enclaves; do
    folder=$keystore/enclaves$enclave
    [ ! -e "$folder/permissions.p7s" ] || continue
    mkdir -p "$folder"
    up=$(echo "$enclave" | sed 's|/[^/]*|../|g')
    for role in identity permissions; do
        ln -sf "${up}../public/${role}_ca.cert.pem" "$folder/${role}_ca.cert.pem"
    done
    ln -sf "${up}governance.p7s" "$folder/governance.p7s"
    new_key "$folder/key.pem"
    run_openssl req -new -sha256 -key "$folder/key.pem" -out "$folder/request.pem" \
        -subj "/CN=$(echo "$enclave" | sed 's|/|\\/|g')"
    echo "basicConstraints = critical, CA:FALSE" |
        run_openssl x509 -req -sha256 -days "$days" -in "$folder/request.pem" -out "$folder/cert.pem" \
            -set_serial "0x$(openssl rand -hex 8)" -extfile /dev/stdin \
            -CA "$keystore/public/ca.cert.pem" -CAkey "$keystore/private/ca.key.pem"
    rm "$folder/request.pem"
    "$program" permissions "$enclave" "${ros_args[@]}" >"$folder/permissions.xml"
    sign "$folder/permissions.xml"
    echo "enclave $enclave"
done

# For the scripts in this folder, which source it: finds the program, and runs parts that start and end together.
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.

# The comment at the head of the script is its help.
case ${1-} in
-h | --help)
    awk 'NR > 1 { if (!/^#/) exit; sub(/^# ?/, ""); print }' "$0"
    exit 0
    ;;
esac

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mistake() { # TEXT
    echo "error: $1" >&2
    exit 2
}

if [ -n "${DQ_SERVO-}" ]; then
    program=$(command -v "$DQ_SERVO") || mistake "DQ_SERVO is $DQ_SERVO, which cannot be run"
else
    program=$here/../target/release/dq_servo
    [ -x "$program" ] || program=$(command -v dq_servo) ||
        mistake "no dq_servo: run 'cargo build --release' first, or set DQ_SERVO"
fi

# Each part has its own process group: ctrl-C reaches only this script, which ends the parts in order.
set -m
parts=()

sim=true guard=false first_motion=false arm=() switches=0
# Takes --arm NAME, and sim:=, guard:=, first_motion:= and arm:= as `ros2 launch` does, at the beginning; `switches` counts these arguments.
take_switches() { # ARGUMENT...
    local count=$#
    while [ $# -gt 0 ]; do
        case $1 in
        --arm)
            [ $# -ge 2 ] || mistake "--arm: expected the name of a built-in arm"
            arm=(--arm "$2")
            shift
            ;;
        arm:=*) arm=(--arm "${1#arm:=}") ;;
        sim:=* | guard:=* | first_motion:=*)
            [[ ${1#*:=} =~ ^(true|false)$ ]] || mistake "$1: expected true or false"
            declare -g "${1/:=/=}"
            ;;
        *) break ;;
        esac
        shift
    done
    switches=$((count - $#))
}

# The namespace of `-r __ns:=` in the arguments, without a slash at its end; the nodes' enclaves are in it too.
namespace_of() { # ARGUMENT...
    for argument; do
        case $argument in
        __ns:=*) argument=${argument#__ns:=} && echo "${argument%/}" && return ;;
        esac
    done
}

# Report mistakes in the arguments of all nodes once, before any node starts.
check() { # NODE ARGUMENT...
    "$program" "$1" --ros-args -- "${@:2}" --ros-args -- --help >/dev/null || exit
}

start() { # ARGUMENT...: a part, which ends before those that were started before it
    "$program" "$@" &
    parts=("$!" ${parts[@]+"${parts[@]}"})
}

end_parts() {
    # A second signal ends all parts at once.
    trap 'kill -TERM "${parts[@]}" 2>/dev/null; exit 1' INT TERM HUP QUIT
    for part in "${parts[@]}"; do
        kill -TERM "$part" 2>/dev/null || :
        wait "$part" || :
    done
}

# Waits for the first part that ends, ends the others, and returns its code.
run_parts() {
    trap end_parts EXIT
    trap 'exit 129' HUP
    trap 'exit 130' INT
    trap 'exit 131' QUIT
    trap 'exit 143' TERM
    code=0
    wait -n "${parts[@]}" || code=$?
    exit "$code"
}

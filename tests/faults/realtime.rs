//! Tests `realtime_priority`: an allowed priority is used, and a forbidden one is refused before anything moves.

use crate::host::{Host, wait_for_line, wait_until};

const NODES: [(&str, &str); 3] =
    [("servo", "waiting for joint states"), ("puma560", "simulating"), ("guard", "watching /")];

const PRIORITY: [&str; 3] = ["--ros-args", "-p", "realtime_priority:=40"];

/// Returns the threads with a real-time policy: their names (cut by the kernel), policies and priorities (proc_pid_stat(5)).
fn scheduling(pid: u32) -> Vec<(String, u32, u32)> {
    let mut found = Vec::new();
    for task in std::fs::read_dir(format!("/proc/{pid}/task")).unwrap().flatten() {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap();
        let (before, after) = stat.rsplit_once(") ").unwrap();
        let (_, name) = before.split_once('(').unwrap();
        // The first field after the name is field 3. Field 40 is the real-time priority, and 41 the policy.
        let fields: Vec<_> = after.split(' ').collect();
        let (priority, policy) = (fields[37].parse().unwrap(), fields[38].parse().unwrap());
        if policy != 0 {
            found.push((name.to_owned(), policy, priority));
        }
    }
    found.sort();
    found
}

fn locked_memory(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

/// Returns whether the limits of a process let it use real-time priorities even without these capabilities.
fn is_allowed_anyway(limit: &str) -> bool {
    let shown =
        std::process::Command::new("prlimit").args(["--raw", "--noheadings", "-o", "SOFT", limit]).output();
    let soft = String::from_utf8(shown.unwrap().stdout).unwrap();
    soft.trim() == "unlimited" || (limit == "--rtprio" && soft.trim().parse::<u32>().unwrap() >= 40)
}

#[test]
fn a_cycle_that_may_have_real_time_has_it_and_its_memory_is_locked() {
    for (node, ready) in NODES {
        // Users other than root would need limits that nobody has by default.
        let Some(mut host) = Host::of_root() else { return };
        wait_for_line(host.start(node, &[&[node], &PRIORITY[..]].concat()), ready);
        let (pid, thread) = (host.pid(node), if node == "puma560" { "plant" } else { node });
        // Some nodes log before their thread has started.
        wait_until(|| (locked_memory(pid) > 0).then_some(()));
        const FIFO: u32 = 1;
        let expected = [("RustDDS Partici", 39), ("RustDDS discove", 39), (thread, 40)];
        let expected = expected.map(|(name, priority)| (name.to_owned(), FIFO, priority));
        assert_eq!(scheduling(pid), expected, "{node}: those of DDS, and the cycle");
        host.signal(node, "TERM");
        assert_eq!(host.wait(node), Some(0));
    }
}

fn is_refused(mut host: Host, node: &str, capability: &str, expected: &str) {
    host.start_without(node, capability, &[&[node], &PRIORITY[..]].concat());
    assert_eq!(host.wait(node), Some(1), "{node}");
    let log = host.errors(node);
    let errors: Vec<_> = log.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && errors[0].contains("realtime_priority 40"), "{node}: {log}");
    assert!(errors[0].contains(expected), "{node}: {log}");
}

#[test]
fn a_cycle_that_may_not_have_real_time_is_refused_with_one_line() {
    for (node, _) in NODES {
        if !is_allowed_anyway("--rtprio") {
            is_refused(Host::new(), node, "-sys_nice", "RLIMIT_RTPRIO of 40");
        }
        if let Some(host) = Host::of_root().filter(|_| !is_allowed_anyway("--memlock")) {
            is_refused(host, node, "-ipc_lock", "RLIMIT_MEMLOCK is ");
        }
    }
}

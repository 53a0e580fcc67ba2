//! Whether RustDDS still works in this process.
//!
//! All that it does is done by two threads, and each of them ends at the first error of its `epoll_wait`, a mere interruption
//! included (RustDDS 0.15.1, `dp_event_loop.rs` and `discovery.rs`: "poll failed"). A process that is stopped and continued meets
//! one: ctrl-Z and `fg`, a debugger, a machine that was suspended. The node would go on, deaf and mute, and tell nobody.

/// The names of the two threads, as far as the kernel keeps them (15 bytes).
const NAMES: [&str; 2] = ["RustDDS discove", "RustDDS Partici"];

/// Whether the threads of this process's participant run; true too where the operating system does not tell.
pub fn network_threads_run() -> bool {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return true };
    let running: Vec<_> =
        tasks.flatten().filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok()).collect();
    NAMES.iter().all(|name| running.iter().any(|thread| thread.trim_end() == *name))
}

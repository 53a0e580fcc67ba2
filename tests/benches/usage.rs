//! The resources that a process uses.

use std::fmt;

/// The resources that a process uses, from `/proc`.
#[derive(Clone, Copy, Debug)]
pub struct Usage {
    /// Resident memory [MB].
    memory: f64,
    threads: usize,
    descriptors: usize,
}

impl Usage {
    /// Returns the usage of the process with this id.
    pub fn of(pid: u32) -> Self {
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
        let value = |key: &str| {
            let line = status.lines().find(|line| line.starts_with(key)).unwrap();
            line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
        };
        Self {
            memory: value("VmRSS:") / 1e3,
            threads: value("Threads:") as usize,
            descriptors: std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap().count(),
        }
    }

    /// Returns whether this usage is larger than `other`. Memory must be larger by more than `noise` [MB].
    pub fn has_outgrown(&self, other: &Self, noise: f64) -> bool {
        self.memory > other.memory + noise
            || self.threads > other.threads
            || self.descriptors > other.descriptors
    }
}

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:5.1} / {} / {}", self.memory, self.threads, self.descriptors)
    }
}

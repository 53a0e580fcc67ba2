//! Two hosts with an impaired network between them.

use crate::host::{Host, PYTHON};
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

const RELAY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults/relay.py");

/// The impairment of frames. It is the same in both directions.
#[derive(Default)]
pub struct Impairment {
    /// The fraction of frames that are lost.
    pub loss: f64,
    /// The delay \[s\].
    pub delay: f64,
    /// The variation of the delay, which reorders frames \[s\].
    pub jitter: f64,
    /// The fraction of frames that are duplicated.
    pub duplicate: f64,
}

/// Two hosts, each in its own network namespace, and the relay between them. The kernel here has no `netem`, and others may lack it
/// too. So the relay is our own program (relay.py) in a third namespace.
pub struct Network {
    relay: Child,
    pub servo_side: Host,
    pub plant_side: Host,
    _between: Host,
}

impl Network {
    /// Creates two hosts that reach each other only through the relay.
    pub fn new(impairment: &Impairment) -> Self {
        let between = Host::without_network();
        let [servo_side, plant_side] = ["to_a", "to_b"].map(|name| {
            let host = between.beside();
            let pid = host.namespace_pid();
            between.shell(&format!("ip link add {name} type veth peer name eth0 netns {pid}"));
            between.shell(&format!("ip link set {name} up promisc on"));
            host
        });
        for (host, number) in [(&servo_side, 1), (&plant_side, 2)] {
            host.shell(&format!("ip address add 10.77.0.{number}/24 dev eth0 && ip link set lo up"));
            host.shell("ip link set eth0 up && ip route add 224.0.0.0/4 dev eth0");
        }
        let Impairment { loss, delay, jitter, duplicate } = impairment;
        let mut relay = between
            .command(PYTHON)
            .arg(RELAY)
            .args([loss, delay, jitter, duplicate].map(f64::to_string))
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(relay.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line, "up\n", "the relay did not start");
        Self { relay, servo_side, plant_side, _between: between }
    }

    /// Returns the relay's process id. SIGUSR1 cuts and restores the network.
    pub fn relay_pid(&self) -> String {
        self.relay.id().to_string()
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _ = self.relay.kill();
        let _ = self.relay.wait();
    }
}

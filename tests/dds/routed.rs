//! Two hosts that only a router connects. For `dds` and for `ros2`.

use crate::host::Host;

/// Two hosts, each in a network of its own, with a router between them that forwards no multicast.
pub struct Routed {
    pub servo_side: Host,
    pub plant_side: Host,
    _router: Host,
}

impl Routed {
    /// Creates the hosts 10.77.1.2 and 10.77.2.2.
    pub fn new() -> Self {
        let router = Host::without_network();
        router.shell("echo 1 >/proc/sys/net/ipv4/ip_forward");
        let [servo_side, plant_side] = [1, 2].map(|network| {
            let host = router.beside();
            let pid = host.namespace_pid();
            router.shell(&format!("ip link add to_{network} type veth peer name eth0 netns {pid}"));
            router.shell(&format!(
                "ip address add 10.77.{network}.1/24 dev to_{network} && ip link set to_{network} up"
            ));
            host.shell(&format!(
                "ip link set lo up && ip address add 10.77.{network}.2/24 dev eth0 && ip link set eth0 up"
            ));
            host.shell(&format!("ip route add default via 10.77.{network}.1"));
            host
        });
        Self { servo_side, plant_side, _router: router }
    }
}

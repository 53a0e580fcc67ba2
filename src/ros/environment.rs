//! ROS 2's own switches: which domain, how far this process may be seen, and whether it is secured.

use super::args::RosArgs;
use super::error::RosError;
use super::security;
use crate::dds::own_domain::OwnDomain;
use crate::dds::ports;
use std::env::VarError;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::PathBuf;

/// How far discovery reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// All interfaces: ROS 2's default.
    Subnet,
    /// This host only.
    Localhost,
}

/// The part of the environment that decides whom this process meets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// DDS domain, 0 to 232 (RTPS port numbers end there).
    pub domain_id: u16,
    /// How far discovery reaches.
    pub reach: Reach,
    /// The folder with the keys and permissions of a secured run; none for a run without security.
    pub enclave: Option<PathBuf>,
}

impl Environment {
    /// Reads `ROS_DOMAIN_ID`, `ROS_AUTOMATIC_DISCOVERY_RANGE`, the older `ROS_LOCALHOST_ONLY`, and `ROS_SECURITY_ENABLE`,
    /// `_STRATEGY`, `_KEYSTORE` and `_ENCLAVE_OVERRIDE` with the enclave of the command line.
    ///
    /// # Errors
    /// [`RosError::Environment`] with the variable and the values that it may have; [`RosError::Security`] where security
    /// is asked for and the enclave is not there; [`RosError::Name`].
    pub fn from_process(args: &RosArgs) -> Result<Self, RosError> {
        for variable in VARIABLES {
            // To pass over what cannot be read would run unsecured, or in another domain, what was to be neither.
            if let Err(VarError::NotUnicode(value)) = std::env::var(variable) {
                let value = value.to_string_lossy().into_owned();
                return Err(RosError::Environment { variable, value, expected: "UTF-8" });
            }
        }
        Self::from_variables(|name| std::env::var(name).ok(), args)
    }

    /// Reads the variables through `lookup`. An empty variable counts as unset, as in ROS 2.
    ///
    /// `ROS_LOCALHOST_ONLY=1` wins over `ROS_AUTOMATIC_DISCOVERY_RANGE`, as in rmw. `OFF` asks for no discovery at all,
    /// with which these nodes could do nothing, so it is refused.
    ///
    /// # Errors
    /// As [`Environment::from_process`].
    pub fn from_variables(lookup: impl Fn(&str) -> Option<String>, args: &RosArgs) -> Result<Self, RosError> {
        let get =
            |name: &str| lookup(name).map(|text| text.trim().to_owned()).filter(|text| !text.is_empty());
        let domain_id = match get("ROS_DOMAIN_ID") {
            None => 0,
            Some(text) => parse_domain(&text)?,
        };
        let range = match get("ROS_AUTOMATIC_DISCOVERY_RANGE") {
            None => Reach::Subnet,
            Some(text) => parse_range(&text)?,
        };
        let reach = match get("ROS_LOCALHOST_ONLY").as_deref() {
            None | Some("0") => range,
            Some("1") => Reach::Localhost,
            Some(other) => {
                return Err(RosError::Environment {
                    variable: "ROS_LOCALHOST_ONLY",
                    value: other.to_owned(),
                    expected: "0 or 1",
                });
            }
        };
        Ok(Self { domain_id, reach, enclave: security::enclave(get, args.enclave.as_deref())? })
    }

    /// The same environment in a domain that nobody else on this host is in, for as long as the second answer lives.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], and [`RosError::NoFreeDomain`] where each domain has somebody.
    pub fn alone(&self) -> Result<(Self, OwnDomain), RosError> {
        let here = Self { reach: Reach::Localhost, ..self.clone() };
        here.check_network()?;
        let domain =
            OwnDomain::find(self.domain_id).ok_or(RosError::NoFreeDomain { highest: OwnDomain::HIGHEST })?;
        Ok((Self { domain_id: domain.id(), ..here }, domain))
    }

    /// Whether nothing beyond this host is seen.
    pub(super) fn is_on_loopback(&self) -> bool {
        self.reach == Reach::Localhost
    }

    /// Fails where nothing sent could arrive anywhere: no loopback, and no route for multicast.
    pub(super) fn check_network(&self) -> Result<(), RosError> {
        let loopback = probe(Ipv4Addr::LOCALHOST);
        match (loopback, self.reach) {
            (Ok(()), _) => Ok(()),
            (Err(why), Reach::Localhost) => Err(RosError::NoNetwork(format!("loopback answers {why}"))),
            (Err(_), Reach::Subnet) => probe(SPDP_MULTICAST).map_err(|why| {
                RosError::NoNetwork(format!(
                    "loopback is down and multicast to {SPDP_MULTICAST} answers {why}"
                ))
            }),
        }
    }
}

/// All variables that are read.
const VARIABLES: [&str; 7] = [
    "ROS_DOMAIN_ID",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
];

/// The multicast group of DDS participant discovery (RTPS 2.5, section 9.6.2.4).
const SPDP_MULTICAST: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// Whether the host has a route to `address`. Connecting a UDP socket sends nothing.
fn probe(address: Ipv4Addr) -> std::io::Result<()> {
    UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?.connect((address, ports::first(0)))
}

fn parse_domain(text: &str) -> Result<u16, RosError> {
    text.parse().ok().filter(|id| *id <= 232).ok_or_else(|| RosError::Environment {
        variable: "ROS_DOMAIN_ID",
        value: text.to_owned(),
        expected: "a number from 0 to 232",
    })
}

fn parse_range(text: &str) -> Result<Reach, RosError> {
    match text {
        "SUBNET" | "SYSTEM_DEFAULT" => Ok(Reach::Subnet),
        "LOCALHOST" => Ok(Reach::Localhost),
        other => Err(RosError::Environment {
            variable: "ROS_AUTOMATIC_DISCOVERY_RANGE",
            value: other.to_owned(),
            expected: "SUBNET, LOCALHOST or SYSTEM_DEFAULT (with OFF no node could be found)",
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Environment, String> {
        let lookup = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        Environment::from_variables(lookup, &RosArgs::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn unset_and_empty_variables_mean_ros_2_defaults() {
        let default = Environment { domain_id: 0, reach: Reach::Subnet, enclave: None };
        assert_eq!(read(&[]), Ok(default.clone()));
        assert_eq!(read(&[("ROS_DOMAIN_ID", ""), ("ROS_LOCALHOST_ONLY", "")]), Ok(default));
    }

    #[test]
    fn switches_are_honoured() {
        assert_eq!(read(&[("ROS_DOMAIN_ID", "42")]).unwrap().domain_id, 42);
        assert_eq!(read(&[("ROS_LOCALHOST_ONLY", "1")]).unwrap().reach, Reach::Localhost);
        assert_eq!(read(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]).unwrap().reach, Reach::Localhost);
        let both = [("ROS_LOCALHOST_ONLY", "1"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")];
        assert_eq!(read(&both).unwrap().reach, Reach::Localhost);
    }

    #[test]
    fn bad_values_are_named_with_what_would_be_right() {
        for (variable, value) in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "-1"),
            ("ROS_DOMAIN_ID", "x"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
        ] {
            let message = read(&[(variable, value)]).unwrap_err();
            assert!(message.contains(variable) && message.contains(value), "{message}");
        }
    }
}

//! Reads ROS 2's environment variables: the domain, the range of discovery, peers, and security.

use super::args::RosArgs;
use super::error::RosError;
use super::names::check_enclave;
use super::{release, unread_variables};
use crate::dds::announcement::GROUP;
use crate::dds::interfaces::VARIABLE as INTERFACES;
use crate::dds::own_domain::OwnDomain;
use crate::dds::ports;
use std::env::VarError;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::{Path, PathBuf};

/// The range of discovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// All interfaces: ROS 2's default.
    Subnet,
    /// This host only.
    Localhost,
}

/// The part of the environment that determines which participants this process meets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// The DDS domain, 0 to 232 (the limit of RTPS port numbers).
    pub domain_id: u16,
    /// The range of discovery.
    pub reach: Reach,
    /// Addresses or names of hosts that discovery must also reach without multicast.
    pub static_peers: Vec<String>,
    /// Names or addresses of the network interfaces to use. If the list is empty, the program chooses the interfaces.
    pub interfaces: Vec<String>,
    /// The folder with the keys and permissions of a secured run; `None` for a run without security.
    pub enclave: Option<PathBuf>,
    /// Warnings about variables that this program does not obey. The first node of the session logs these warnings.
    pub warnings: Vec<String>,
}

impl Environment {
    /// Creates an environment without peers and without security.
    pub fn new(domain_id: u16, reach: Reach) -> Self {
        let (static_peers, interfaces, warnings) = (Vec::new(), Vec::new(), Vec::new());
        Self { domain_id, reach, static_peers, interfaces, enclave: None, warnings }
    }

    /// Reads `ROS_DOMAIN_ID`, `ROS_AUTOMATIC_DISCOVERY_RANGE`, the older `ROS_LOCALHOST_ONLY`, `ROS_STATIC_PEERS`,
    /// `ROS_SECURITY_ENABLE`, `_STRATEGY`, `_KEYSTORE` and `_ENCLAVE_OVERRIDE`, and `DQ_SERVO_INTERFACES`. The enclave may also be
    /// named on the command line.
    ///
    /// # Errors
    /// [`RosError::Environment`] with the variable and its valid values; [`RosError::Security`] if security is requested and the
    /// enclave does not exist; [`RosError::Name`] if the enclave's name is invalid.
    pub fn from_process(args: &RosArgs) -> Result<Self, RosError> {
        for variable in VARIABLES {
            // If an unreadable value were ignored, the process could run unsecured or in the wrong domain.
            if let Err(VarError::NotUnicode(value)) = std::env::var(variable) {
                let value = value.to_string_lossy().into_owned();
                return Err(RosError::Environment { variable, value, expected: "UTF-8" });
            }
        }
        Self::from_variables(|name| std::env::var(name).ok(), args)
    }

    /// Reads the variables through `lookup`. An empty variable counts as unset, as in ROS 2.
    ///
    /// `ROS_LOCALHOST_ONLY=1` wins over `ROS_AUTOMATIC_DISCOVERY_RANGE`, as in rmw. The range `OFF` is refused, because nodes
    /// without discovery could do nothing.
    ///
    /// # Errors
    /// The errors of [`Environment::from_process`].
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
                return Err(refused("ROS_LOCALHOST_ONLY", other, "0 or 1"));
            }
        };
        let list = |name: &str| -> Vec<_> {
            let text = get(name).unwrap_or_default();
            text.split(';').map(str::trim).filter(|item| !item.is_empty()).map(str::to_owned).collect()
        };
        let (mut static_peers, interfaces) = (list("ROS_STATIC_PEERS"), list(INTERFACES));
        let unread = unread_variables::warning(get);
        let distribution = get("ROS_DISTRO").and_then(|name| release::warning_of_distribution(&name));
        let mut warnings: Vec<_> = unread.into_iter().chain(distribution).collect();
        if reach == Reach::Localhost && !static_peers.is_empty() {
            static_peers.clear();
            warnings.push(PEERS_WITHOUT_NETWORK.to_owned());
        }
        let enclave = enclave(get, args.enclave.as_deref(), SECURITY)?;
        Ok(Self { domain_id, reach, static_peers, interfaces, enclave, warnings })
    }

    /// Returns this environment, but in a domain that nobody else on this host uses. The domain is reserved until the returned
    /// `OwnDomain` is dropped. Peers and warnings are left out, because they do not apply to such a domain.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], and [`RosError::NoFreeDomain`] if every domain is in use.
    pub fn alone(&self) -> Result<(Self, OwnDomain), RosError> {
        let here = Self { enclave: self.enclave.clone(), ..Self::new(self.domain_id, Reach::Localhost) };
        here.check_network()?;
        let domain =
            OwnDomain::find(self.domain_id).ok_or(RosError::NoFreeDomain { highest: OwnDomain::HIGHEST })?;
        Ok((Self { domain_id: domain.id(), ..here }, domain))
    }

    /// Returns whether discovery is restricted to this host.
    pub(super) fn is_on_loopback(&self) -> bool {
        self.reach == Reach::Localhost
    }

    /// Returns an error if no packet of this session could arrive anywhere. With [`Reach::Localhost`], this is the case if the host
    /// has no loopback; with [`Reach::Subnet`], if it has neither loopback nor a route for multicast.
    pub(super) fn check_network(&self) -> Result<(), RosError> {
        let loopback = probe(Ipv4Addr::LOCALHOST);
        match (loopback, self.reach) {
            (Ok(()), _) => Ok(()),
            (Err(why), Reach::Localhost) => Err(RosError::NoNetwork(format!("loopback answers {why}"))),
            (Err(_), Reach::Subnet) => probe(GROUP).map_err(|why| {
                RosError::NoNetwork(format!("loopback is down and multicast to {GROUP} answers {why}"))
            }),
        }
    }
}

/// The names of all variables that this program obeys.
const VARIABLES: [&str; 9] = [
    INTERFACES,
    "ROS_DOMAIN_ID",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
];

/// The warning about `ROS_STATIC_PEERS` in a session on loopback. ROS 2 also ignores this variable if `ROS_LOCALHOST_ONLY` is 1.
const PEERS_WITHOUT_NETWORK: &str = "ROS_STATIC_PEERS has no effect: discovery is restricted to this host (unset ROS_LOCALHOST_ONLY and ROS_AUTOMATIC_DISCOVERY_RANGE)";

/// Checks whether the host has a route to `address`. Connecting a UDP socket sends nothing.
fn probe(address: Ipv4Addr) -> std::io::Result<()> {
    UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?.connect((address, ports::first(0)))
}

fn parse_domain(text: &str) -> Result<u16, RosError> {
    let id = text.parse().ok().filter(|id| *id <= 232);
    id.ok_or_else(|| refused("ROS_DOMAIN_ID", text, "a number from 0 to 232"))
}

fn refused(variable: &'static str, value: &str, expected: &'static str) -> RosError {
    RosError::Environment { variable, value: value.to_owned(), expected }
}

fn parse_range(text: &str) -> Result<Reach, RosError> {
    match text {
        "SUBNET" | "SYSTEM_DEFAULT" => Ok(Reach::Subnet),
        "LOCALHOST" => Ok(Reach::Localhost),
        other => {
            let expected = "SUBNET, LOCALHOST or SYSTEM_DEFAULT (with OFF no node could be found)";
            Err(refused("ROS_AUTOMATIC_DISCOVERY_RANGE", other, expected))
        }
    }
}

/// Whether this program was built with security.
const SECURITY: bool = cfg!(feature = "security");

/// Returns the folder of the enclave that the variables and the command line name; `None` if security is not requested.
///
/// The variables have the same meaning as in rcl, with one exception. In rcl, `ROS_SECURITY_STRATEGY=Permissive` (or unset) lets a
/// node whose enclave is missing run without security. Here a node never runs without security if security is requested.
///
/// # Errors
/// [`RosError::Environment`] for values that ROS 2 does not know (ROS 2 would treat them as "off", which users hardly intend), and
/// if the program was built without security (`built_in` is false); [`RosError::Security`] if the enclave does not exist.
fn enclave(
    get: impl Fn(&str) -> Option<String>,
    argument: Option<&str>,
    built_in: bool,
) -> Result<Option<PathBuf>, RosError> {
    let one_of = |variable, known: [&str; 2], expected| match get(variable) {
        Some(value) if !known.contains(&value.as_str()) => {
            Err(RosError::Environment { variable, value, expected })
        }
        value => Ok(value),
    };
    let enable = one_of("ROS_SECURITY_ENABLE", ["true", "false"], "true or false")?;
    if enable.as_deref() != Some("true") {
        return Ok(None);
    }
    if !built_in {
        let expected = "false: this program was built without security (cargo build --features security)";
        return Err(refused("ROS_SECURITY_ENABLE", "true", expected));
    }
    one_of("ROS_SECURITY_STRATEGY", ["Enforce", "Permissive"], "Enforce or Permissive")?;
    let expected = "the folder of a keystore, because ROS_SECURITY_ENABLE=true";
    let keystore = "ROS_SECURITY_KEYSTORE";
    let keystore = get(keystore).ok_or_else(|| refused(keystore, "", expected))?;
    let name = get("ROS_SECURITY_ENCLAVE_OVERRIDE");
    let name = name.as_deref().or(argument).unwrap_or("/");
    check_enclave(name)?;
    let path = Path::new(&keystore).join("enclaves").join(name.trim_start_matches('/'));
    match path.is_dir() {
        true => Ok(Some(path)),
        false => {
            let why = format!(
                "no such enclave in the keystore (name one with --ros-args --enclave; it was {name:?})"
            );
            Err(RosError::Security { path, why })
        }
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
        let default = Environment::new(0, Reach::Subnet);
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
    fn peers_are_separated_by_semicolons_and_need_a_network() {
        let peers = ("ROS_STATIC_PEERS", " 10.0.0.5;;robot.local ;");
        let read_with = |others: &[_]| read(&[&[peers], others].concat()).unwrap();
        assert_eq!(read_with(&[]).static_peers, ["10.0.0.5", "robot.local"]);
        assert_eq!(read_with(&[]).warnings, [""; 0]);
        assert_eq!(read_with(&[("DQ_SERVO_INTERFACES", "eth0; 10.0.0.6")]).interfaces, ["eth0", "10.0.0.6"]);
        let on_loopback = read_with(&[("ROS_LOCALHOST_ONLY", "1")]);
        assert_eq!((on_loopback.static_peers.len(), on_loopback.warnings.len()), (0, 1));
    }

    #[test]
    fn a_program_for_another_release_says_how_to_build_it() {
        for distribution in ["humble", "iron", "jazzy", "kilted", "lyrical", "rolling"] {
            let is_other = (distribution == "humble") != cfg!(feature = "humble");
            let warnings = read(&[("ROS_DISTRO", distribution)]).unwrap().warnings;
            assert_eq!(warnings.len(), usize::from(is_other), "{warnings:?}");
            assert!(warnings.iter().all(|warning| warning.contains("--features humble")), "{warnings:?}");
        }
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

    fn folder(variables: &[(&str, &str)], argument: Option<&str>) -> Result<Option<PathBuf>, String> {
        let get = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        enclave(get, argument, SECURITY).map_err(|error| error.to_string())
    }

    #[test]
    fn security_is_off_unless_asked_for() {
        assert_eq!(folder(&[], Some("/x")), Ok(None));
        let off = [("ROS_SECURITY_ENABLE", "false"), ("ROS_SECURITY_KEYSTORE", "/nowhere")];
        assert_eq!(folder(&off, None), Ok(None));
    }

    #[test]
    fn switches_other_than_true_or_false_are_rejected() {
        for value in ["True", "1", "yes", "Enforce"] {
            let message = folder(&[("ROS_SECURITY_ENABLE", value)], None).unwrap_err();
            assert!(message.contains(value) && message.contains("true or false"), "{message}");
        }
    }

    #[test]
    fn a_program_built_without_security_never_runs_where_it_was_asked_for() {
        let asked = |name: &str| (name == "ROS_SECURITY_ENABLE").then(|| "true".to_owned());
        let message = enclave(asked, None, false).unwrap_err().to_string();
        assert!(message.contains("built without security"), "{message}");
    }
}

//! DDS Security by ROS 2's own switches: whether, and with whose keys and permissions.
//!
//! They mean what they mean in rcl, but for one thing. There, `ROS_SECURITY_STRATEGY=Permissive` (or unset) lets a node
//! whose enclave is missing run without security. Here a node for which security was asked runs with it or not at all.

use super::error::RosError;
use super::names::check_enclave;
use std::path::{Path, PathBuf};

/// The folder of the enclave that the variables and the command line name; none where security is not asked for.
///
/// # Errors
/// [`RosError::Environment`] for values that ROS 2 does not know (it would take them for "off", who sets them hardly does),
/// and where this program was built without security; [`RosError::Security`] where there is no such enclave.
pub(super) fn enclave(
    get: impl Fn(&str) -> Option<String>,
    argument: Option<&str>,
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
    built_in()?;
    one_of("ROS_SECURITY_STRATEGY", ["Enforce", "Permissive"], "Enforce or Permissive")?;
    let keystore = get("ROS_SECURITY_KEYSTORE").ok_or_else(|| RosError::Environment {
        variable: "ROS_SECURITY_KEYSTORE",
        value: String::new(),
        expected: "the folder of a keystore, because ROS_SECURITY_ENABLE=true",
    })?;
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

/// Fails where this program was built without security.
fn built_in() -> Result<(), RosError> {
    match cfg!(feature = "security") {
        true => Ok(()),
        false => Err(RosError::Environment {
            variable: "ROS_SECURITY_ENABLE",
            value: "true".to_owned(),
            expected: "false: this program was built without security (cargo build --features security)",
        }),
    }
}

/// Nothing can be secured without the feature.
#[cfg(not(feature = "security"))]
pub(super) fn participant(
    _: rustdds::DomainParticipantBuilder,
    _enclave: &Path,
    _domain: u16,
    what: &str,
) -> Result<(rustdds::DomainParticipant, Option<String>), RosError> {
    built_in().and(Err(RosError::create(what)(&"not secured")))
}

/// A participant, called `what` in errors, with the keys and permissions in the folder `enclave`, whose files have sros2's
/// names; and what its operator should know of the governance, if anything.
///
/// # Errors
/// [`RosError::Security`] for the first file that is missing, wrong or out of date, [`RosError::Create`].
#[cfg(feature = "security")]
pub(super) fn participant(
    builder: rustdds::DomainParticipantBuilder,
    enclave: &Path,
    domain: u16,
    what: &str,
) -> Result<(rustdds::DomainParticipant, Option<String>), RosError> {
    use crate::dds::{certificates, payload_protection};
    use rustdds::DomainParticipantSecurityConfigFiles as Files;
    use rustdds::dds::CreateError;
    certificates::check(enclave)
        .map_err(|certificates::Unusable { path, why }| RosError::Security { path, why })?;
    let files = Files::with_ros_default_names(enclave, String::new());
    let participant = builder.builtin_security(files).build().map_err(|why| match why {
        CreateError::NotAllowedBySecurity { reason } => {
            RosError::Security { path: enclave.to_owned(), why: reason }
        }
        other => RosError::create(what)(&other),
    })?;
    Ok((participant, payload_protection::warning(&enclave.join("governance.p7s"), domain)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(variables: &[(&str, &str)], argument: Option<&str>) -> Result<Option<PathBuf>, String> {
        let get = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        enclave(get, argument).map_err(|error| error.to_string())
    }

    #[test]
    fn security_is_off_unless_asked_for() {
        assert_eq!(folder(&[], Some("/x")), Ok(None));
        let off = [("ROS_SECURITY_ENABLE", "false"), ("ROS_SECURITY_KEYSTORE", "/nowhere")];
        assert_eq!(folder(&off, None), Ok(None));
    }

    #[test]
    fn what_only_looks_like_a_switch_is_refused() {
        for value in ["True", "1", "yes", "Enforce"] {
            let message = folder(&[("ROS_SECURITY_ENABLE", value)], None).unwrap_err();
            assert!(message.contains(value) && message.contains("true or false"), "{message}");
        }
    }

    #[cfg(not(feature = "security"))]
    #[test]
    fn without_the_feature_security_cannot_be_had() {
        let message = folder(&[("ROS_SECURITY_ENABLE", "true")], None).unwrap_err();
        assert!(message.contains("built without security"), "{message}");
        let builder = rustdds::DomainParticipantBuilder::new(0);
        assert!(participant(builder, Path::new("/nowhere"), 0, "a participant").is_err());
    }
}

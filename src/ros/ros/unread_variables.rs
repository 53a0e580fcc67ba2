//! Environment variables that choose the middleware or its peers, but that this program does not obey.

/// The names of the implementations of DDS that can occur in the value of `RMW_IMPLEMENTATION`. Other middleware does not use DDS.
const DDS: [&str; 4] = ["fastrtps", "cyclonedds", "connext", "gurumdds"];

/// Variables that this program does not obey, each with the consequence for users who set it.
const UNREAD: [(&str, &str); 5] = [
    ("ROS_DISCOVERY_SERVER", SERVER),
    ("ROS2_EASY_MODE", SERVER),
    ("FASTRTPS_DEFAULT_PROFILES_FILE", FILE),
    ("FASTDDS_DEFAULT_PROFILES_FILE", FILE),
    ("CYCLONEDDS_URI", FILE),
];

const SERVER: &str =
    "nodes that are found through a discovery server do not meet this program, so unset it for them too";
const FILE: &str =
    "its peers, interfaces and security do not hold for this program, so name peers in ROS_STATIC_PEERS";

/// Returns one warning about all variables that are set but not obeyed. `get` returns the value of a variable; `None` if it is
/// unset or empty.
pub(super) fn warning(get: impl Fn(&str) -> Option<String>) -> Option<String> {
    let middleware = get("RMW_IMPLEMENTATION").filter(|name| !DDS.iter().any(|dds| name.contains(dds)));
    let middleware = middleware.map(|name| {
        format!(
            "RMW_IMPLEMENTATION={name}: this program speaks DDS and does not meet nodes on {name}, so start them with rmw_fastrtps_cpp or \
             rmw_cyclonedds_cpp"
        )
    });
    let unread = UNREAD.iter().filter(|(name, _)| get(name).is_some());
    let parts: Vec<_> = middleware
        .into_iter()
        .chain(unread.map(|(name, meaning)| format!("{name} is not read: {meaning}")))
        .collect();
    (!parts.is_empty()).then(|| parts.join(". "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_obeyed_is_in_one_warning_and_what_needs_none_is_not() {
        let warning = |set: &[(&str, &str)]| {
            warning(|name| set.iter().find(|(set, _)| *set == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(warning(&[]), None);
        for middleware in
            ["rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp", "rmw_cyclonedds_cpp", "rmw_connextdds"]
        {
            assert_eq!(warning(&[("RMW_IMPLEMENTATION", middleware)]), None);
        }
        let both =
            warning(&[("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"), ("CYCLONEDDS_URI", "file:///x.xml")]).unwrap();
        assert!(
            both.contains("does not meet nodes on rmw_zenoh_cpp") && both.contains("CYCLONEDDS_URI is not"),
            "{both}"
        );
        for (variable, _) in UNREAD {
            assert!(warning(&[(variable, "x")]).unwrap().starts_with(variable));
        }
    }
}

//! Tests environment variables, including those of security.

use crate::{assert_one_line, cases};
use dq_ros::ros::{Environment, RosArgs};
use proptest::prelude::*;
use proptest::sample::select;
use std::collections::BTreeMap;
use std::sync::LazyLock;

const VARIABLES: [&str; 7] = [
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
];

/// A folder with a keystore that has two enclaves, and with a folder outside of the keystore.
static KEYSTORE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    for folder in ["keystore/enclaves/a/b", "outside"] {
        std::fs::create_dir_all(directory.path().join(folder)).unwrap();
    }
    directory
});

fn value() -> impl Strategy<Value = String> {
    let keystore = KEYSTORE.path().join("keystore").display().to_string();
    let known = concat!(
        "true¦false¦Enforce¦Permissive¦0¦1¦232¦233¦SUBNET¦LOCALHOST¦OFF¦/¦/a¦/a/b¦a¦/..¦/../..¦",
        "/../../outside¦/a/../../outside¦//¦/a/¦~¦¦ ¦\n¦\u{0}",
    );
    prop_oneof![
        8 => select(known.split('¦').collect::<Vec<_>>()).prop_map(str::to_owned),
        4 => Just(keystore),
        1 => any::<String>(),
    ]
}

proptest! {
    #![proptest_config(cases(5000))]
    #[test]
    fn any_environment_is_accepted_or_rejected_and_security_is_never_lost(
        set in prop::collection::btree_map(select(VARIABLES.to_vec()), value(), 0..8),
        enclave in prop::option::of(value()),
    ) {
        let set: BTreeMap<&str, String> = set;
        let args = RosArgs { enclave, ..RosArgs::default() };
        let asked = set.get("ROS_SECURITY_ENABLE").map_or("", |text| text.trim());
        match Environment::from_variables(|name| set.get(name).cloned(), &args) {
            Ok(environment) => {
                prop_assert!(environment.domain_id <= 232);
                prop_assert_eq!(environment.enclave.is_some(), asked == "true");
                prop_assert!(["", "true", "false"].contains(&asked));
                let enclaves = KEYSTORE.path().join("keystore/enclaves");
                let inside = |path: &std::path::PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(&enclaves));
                prop_assert!(environment.enclave.iter().all(inside), "{:?}", environment.enclave);
            }
            Err(why) => assert_one_line(&why),
        }
    }
}

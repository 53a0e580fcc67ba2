//! Tests that a node for which security is requested but not possible reports why and does not run.

use crate::host::Host;
use crate::insiders::run;
use crate::keystore::{Keystore, Variables};
use dq_ros::ros::{Environment, RosArgs};
use std::path::PathBuf;

/// Runs a servo, which must end with code 2 and one line that contains `reason`.
fn refused(host: &Host, variables: &Variables, enclave: &str, reason: &str) {
    let output = run(host, variables, &["servo"], enclave);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{reason}: {message}");
    assert!(message.contains(reason) && message.lines().count() == 1, "{reason}: {message}");
}

#[test]
fn a_missing_enclave_or_keystore_is_never_a_run_without_security() {
    let (keystore, host) = (Keystore::new(), Host::new());
    for strategy in ["Enforce", "Permissive"] {
        let mut variables = keystore.variables();
        variables[1].1 = strategy.to_owned();
        refused(&host, &variables, "/nobody", "enclaves/nobody: no such enclave");
        refused(&host, &variables, "/left", "enclaves/left/cert.pem: No such file");
        refused(&host, &variables[..2].to_vec(), "/dq_servo", "ROS_SECURITY_KEYSTORE");
    }
    let mut overridden = keystore.variables();
    overridden.push(("ROS_SECURITY_ENCLAVE_OVERRIDE", "/somebody".to_owned()));
    refused(&host, &overridden, "/dq_servo", "enclaves/somebody: no such enclave");
}

#[test]
fn an_enclave_s_own_files_that_are_wrong_or_out_of_date_are_named() {
    let (whole, host) = (Keystore::new(), Host::new());
    let issue = |days: i32, subject: &str| {
        format!(
            "cd enclaves/dq_servo; openssl req -new -key key.pem -subj '/CN=\\{subject}' | openssl x509 -req -days {days} \
             -CA ../../public/ca.cert.pem -CAkey ../../private/ca.key.pem -set_serial 7 -out cert.pem"
        )
    };
    let sign = "openssl smime -sign -text -signer public/ca.cert.pem -inkey private/ca.key.pem";
    for (damage, reason) in [
        (issue(-1, "/dq_servo"), "enclaves/dq_servo/cert.pem: the certificate expired on "),
        (issue(1, "/other"), "not found in the permissions"),
        ("cp enclaves/puma560/key.pem enclaves/dq_servo".to_owned(), "dq_servo/key.pem: not the key of cert.pem"),
        ("echo x > enclaves/dq_servo/key.pem".to_owned(), "dq_servo/key.pem: no private key"),
        ("echo x > enclaves/dq_servo/cert.pem".to_owned(), "dq_servo/cert.pem: no certificate"),
        ("rm enclaves/dq_servo/permissions.p7s".to_owned(), "dq_servo/permissions.p7s: No such file"),
        (
            "cd enclaves/dq_servo; rm identity_ca.cert.pem; openssl req -x509 -newkey rsa:2048 -nodes -keyout k -subj /CN=x \
             -out identity_ca.cert.pem"
                .to_owned(),
            "dq_servo/cert.pem: not signed by identity_ca.cert.pem",
        ),
        // These are a signed document with a changed word, a document of another domain, and an expired one.
        ("sed -i s/goal_pose/goal_p0se/ enclaves/dq_servo/permissions.p7s".to_owned(), "enclaves/dq_servo: "),
        ("sed -i s/ENCRYPT/NONE/ enclaves/governance.p7s".to_owned(), "enclaves/dq_servo: "),
        (
            format!("sed -i s/232/5/ enclaves/governance.xml; {sign} -in enclaves/governance.xml -out enclaves/governance.p7s"),
            "domain_id 77",
        ),
        (
            format!(
                "cd enclaves/dq_servo; sed -i -E 's/20[0-9]{{2}}-/2020-/' permissions.xml; cd ../..; \
                 {sign} -in enclaves/dq_servo/permissions.xml -out enclaves/dq_servo/permissions.p7s"
            ),
            "not found in the permissions",
        ),
    ] {
        let keystore = whole.copy();
        keystore.shell(&damage);
        refused(&host, &keystore.variables(), "/dq_servo", reason);
    }
}

#[test]
fn the_script_keeps_existing_files_and_refuses_invalid_namespaces() {
    let keystore = Keystore::new();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo_keystore.sh");
    let read = |name: &str| std::fs::read(keystore.path(name)).unwrap();
    let before = (read("private/ca.key.pem"), read("enclaves/dq_servo/key.pem"));
    keystore.shell(&format!("{script} . /cell/a"));
    assert_eq!((read("private/ca.key.pem"), read("enclaves/dq_servo/key.pem")), before);
    assert!(
        String::from_utf8_lossy(&read("enclaves/cell/a/dq_servo/permissions.xml"))
            .contains("rt/cell/a/goal_pose")
    );
    for namespace in ["/left/", "/a//b", "/a b"] {
        keystore.shell(&format!("! {script} . '{namespace}'"));
    }
}

#[test]
fn the_enclave_is_the_override_s_then_the_argument_s_then_the_root() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(directory.path().join("enclaves/a/b")).unwrap();
    let keystore = directory.path().to_str().unwrap();
    let asked = [("ROS_SECURITY_ENABLE", "true"), ("ROS_SECURITY_KEYSTORE", keystore)];
    let enclave = |extra: &[(&str, &str)], argument: Option<&str>| -> Result<Option<PathBuf>, String> {
        let set = [&asked[..], extra].concat();
        let lookup = |name: &str| set.iter().find(|(n, _)| *n == name).map(|(_, value)| (*value).to_owned());
        let args = RosArgs { enclave: argument.map(str::to_owned), ..RosArgs::default() };
        let environment = Environment::from_variables(lookup, &args).map_err(|error| error.to_string());
        environment.map(|environment| environment.enclave)
    };
    let at = |name: &str| Ok(Some(directory.path().join(name)));
    assert_eq!(enclave(&[], None), at("enclaves"));
    assert_eq!(enclave(&[], Some("/a/b")), at("enclaves/a/b"));
    assert_eq!(enclave(&[("ROS_SECURITY_ENCLAVE_OVERRIDE", "/a")], Some("/a/b")), at("enclaves/a"));
    for (extra, named) in [
        (("ROS_SECURITY_STRATEGY", "enforce"), "Enforce or Permissive"),
        (("ROS_SECURITY_ENCLAVE_OVERRIDE", "a"), "a slash first"),
        (("ROS_SECURITY_ENCLAVE_OVERRIDE", "/../a"), "letters, digits"),
    ] {
        let message = enclave(&[extra], None).unwrap_err();
        assert!(message.contains(named), "{message}");
    }
}

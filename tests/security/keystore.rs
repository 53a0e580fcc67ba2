//! Keystores that the script of this checkout makes.

use crate::host::assert_success;
use std::path::PathBuf;
use std::process::Command;
use tempfile::TempDir;

/// The program that the script calls for permissions.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_dq_servo");

/// Environment variables.
pub type Variables = Vec<(&'static str, String)>;

/// Returns the variables that make a process unsecured in any environment.
pub fn unsecured() -> Variables {
    vec![("ROS_SECURITY_ENABLE", "false".to_owned())]
}

/// A keystore. It is deleted when this value is dropped.
pub struct Keystore(TempDir);

impl Keystore {
    /// Creates a keystore with its own authority.
    pub fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo_keystore.sh");
        assert_success(
            &Command::new(script).arg(directory.path()).env("DQ_SERVO", PROGRAM).output().unwrap(),
        );
        Self(directory)
    }

    /// Returns a copy of the keystore, with the same authority and keys.
    pub fn copy(&self) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let copied = Command::new("cp").arg("-a").arg(self.path(".")).arg(directory.path()).output();
        assert_success(&copied.unwrap());
        Self(directory)
    }

    /// Returns the variables that make a process run secured with this keystore.
    pub fn variables(&self) -> Variables {
        vec![
            ("ROS_SECURITY_ENABLE", "true".to_owned()),
            ("ROS_SECURITY_STRATEGY", "Enforce".to_owned()),
            ("ROS_SECURITY_KEYSTORE", self.0.path().display().to_string()),
        ]
    }

    /// Returns the path of a file or folder in the keystore.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Changes the governance and signs it.
    pub fn govern(&self, change: impl Fn(&str) -> String) {
        let file = self.path("enclaves/governance.xml");
        std::fs::write(&file, change(&std::fs::read_to_string(&file).unwrap())).unwrap();
        self.shell(
            "openssl smime -sign -text -signer public/ca.cert.pem -inkey private/ca.key.pem \
             -in enclaves/governance.xml -out enclaves/governance.p7s",
        );
    }

    /// Runs a shell command in the folder of the keystore.
    pub fn shell(&self, script: &str) {
        assert_success(
            &Command::new("sh")
                .args(["-euc", script])
                .env("DQ_SERVO", PROGRAM)
                .current_dir(&self.0)
                .output()
                .unwrap(),
        );
    }
}

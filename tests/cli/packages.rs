//! Tests the packages that `.ci/packages` makes for Debian and for ROS 2, with this program in them.

use crate::dq_servo;
use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Returns what a command prints.
fn output(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Makes both packages, and unpacks each into a folder of its name, `deb` and `dq_servo`. A script that runs the program is in its place,
/// because compressing a debug build takes long.
fn packages() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    std::fs::write(&program, format!("#!/bin/sh\nexec '{}' \"$@\"\n", env!("CARGO_BIN_EXE_dq_servo")))
        .unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let script = Path::new(ROOT).join(".ci/packages");
    output(Command::new(script).arg(program).arg("2.17").arg(folder.path()));
    let unpack = "dpkg-deb -x dq-servo_*.deb deb && dpkg-deb -f dq-servo_*.deb >control && tar -xf dq_servo-*-ament-*.tar.gz";
    output(Command::new("sh").args(["-c", unpack]).current_dir(folder.path()));
    folder
}

#[test]
fn the_deb_has_what_the_program_prints_for_shells_and_man() {
    let folder = packages();
    let version = env!("CARGO_PKG_VERSION");
    let control = std::fs::read_to_string(folder.path().join("control")).unwrap();
    for field in ["Package: dq-servo", &format!("Version: {version}"), "Depends: libc6 (>= 2.17)"] {
        assert!(control.lines().any(|line| line == field), "{field}: {control}");
    }
    let share = folder.path().join("deb/usr/share");
    for (file, arguments) in [
        ("man/man1/dq_servo.1.gz", "man"),
        ("bash-completion/completions/dq_servo", "completions bash"),
        ("zsh/vendor-completions/_dq_servo", "completions zsh"),
        ("fish/vendor_completions.d/dq_servo.fish", "completions fish"),
    ] {
        // Files that are not compressed are printed as they are.
        let packed = output(Command::new("gzip").args(["-dcf"]).arg(share.join(file)));
        let printed = dq_servo(arguments).assert().success().get_output().stdout.clone();
        assert!(packed == String::from_utf8(printed).unwrap() && packed.len() > 1000, "{file}: {packed}");
    }
    // The launch script finds the program on the PATH, which rejects the argument.
    let path = format!("{}:/usr/bin:/bin", folder.path().join("deb/usr/bin").display());
    let mut script = assert_cmd::Command::new(share.join("dq_servo/launch/dq_servo.sh"));
    let rejected = script.env_remove("DQ_SERVO").env("PATH", path).arg("--bogus").assert().code(2);
    let error = String::from_utf8(rejected.get_output().stderr.clone()).unwrap();
    assert!(error.contains("--bogus"), "{error}");
}

#[test]
fn the_ros_2_package_depends_on_what_its_launch_files_import() {
    let folder = packages();
    let package = folder.path().join("dq_servo");
    let text = std::fs::read_to_string(package.join("package.xml")).unwrap();
    let manifest = roxmltree::Document::parse(&text).unwrap();
    let texts = |tag: &str| {
        let elements = manifest.descendants().filter(|node| node.has_tag_name(tag));
        elements.map(|node| node.text().unwrap().to_owned()).collect::<BTreeSet<_>>()
    };
    assert_eq!(texts("version"), BTreeSet::from([env!("CARGO_PKG_VERSION").to_owned()]));
    let mut imported = BTreeSet::new();
    let launch_files = std::fs::read_dir(package.join("share/dq_servo/launch")).unwrap();
    for file in launch_files.map(|entry| std::fs::read_to_string(entry.unwrap().path()).unwrap()) {
        let modules = file.lines().filter_map(|line| line.strip_prefix("from ")?.split([' ', '.']).next());
        imported.extend(modules.filter(|module| *module != "pathlib").map(str::to_owned));
    }
    assert!(imported.contains("launch_ros") && imported.is_subset(&texts("exec_depend")), "{imported:?}");
    let version = output(Command::new(package.join("lib/dq_servo/dq_servo")).arg("--version"));
    assert_eq!(version, format!("dq_servo {}\n", env!("CARGO_PKG_VERSION")));
}

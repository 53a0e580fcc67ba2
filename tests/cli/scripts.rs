//! Tests the launch files and scripts.

use assert_cmd::Command;
use std::os::unix::fs::PermissionsExt;

#[test]
fn the_scripts_say_what_they_miss() {
    for name in ["dq_servo", "dq_dual_servo"] {
        for (program, argument, said) in
            [("/nonexistent", "", "/nonexistent"), ("true", "sim:=maybe", "expected true or false")]
        {
            let mut command = Command::new(script(name));
            let refused = command.env("DQ_SERVO", program).arg(argument).assert().code(2);
            let stderr = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
            assert!(stderr.starts_with("error: ") && stderr.contains(said), "{stderr}");
        }
    }
}

/// Returns the command line of each node that a launch file starts with these arguments, without the program. Also checks that a
/// node that has lost the network is launched again after longer and longer pauses, and that any other end of a node ends all
/// nodes.
fn launched(name: &str, arguments: &[&str]) -> Result<Vec<String>, String> {
    let home = env!("CARGO_MANIFEST_DIR");
    let output = std::process::Command::new("python3")
        .arg(format!("{home}/tests/stock/launch_files.py"))
        .arg(format!("{home}/launch_scripts/{name}.launch.py"))
        .args(arguments)
        .output()
        .unwrap();
    if !output.status.success() {
        return Err(String::from_utf8(output.stderr).unwrap());
    }
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let line = |node: &serde_json::Value| {
        let words = node.as_array().unwrap().iter().skip(1).map(|word| word.as_str().unwrap());
        words.collect::<Vec<_>>().join(" ").replace(home, "HOME")
    };
    Ok(printed["nodes"].as_array().unwrap().iter().map(line).collect())
}

#[test]
fn launch_files_start_nodes_in_their_namespaces_with_the_arm_and_the_files_that_are_named() {
    assert_eq!(
        launched("dq_servo", &[]).unwrap(),
        [
            "puma560 --ros-args --enclave /puma560 --log-level info",
            "servo --ros-args --enclave /dq_servo --log-level info",
        ]
    );
    let real = [
        "sim:=false",
        "guard:=true",
        "arm:=ur5e",
        "namespace:=/left",
        "first_motion:=true",
        "params_file:=my.yaml",
    ];
    let common = "-r __ns:=/left --params-file my.yaml --params-file HOME/msg_config/first_motion.yaml";
    assert_eq!(
        launched("dq_servo", &real).unwrap(),
        [
            format!("guard --arm ur5e --ros-args --enclave /left/dq_servo_guard --log-level info {common}"),
            format!("servo --arm ur5e --ros-args --enclave /left/dq_servo --log-level info {common}"),
        ]
    );
    let sides = ["left", "right"].map(|side| {
        format!("puma560 --ros-args --enclave /{side}/puma560 --log-level warn -r __ns:=/{side} --params-file HOME/msg_config/dual.yaml")
    });
    let dual =
        "dual --ros-args --enclave /dq_dual_servo --log-level warn --params-file HOME/msg_config/dual.yaml";
    assert_eq!(launched("dq_dual_servo", &["log_level:=warn"]).unwrap(), [&sides[0], &sides[1], dual]);
    let refused = launched("dq_servo", &["sim:=maybe"]).unwrap_err();
    assert!(refused.contains("sim: 'maybe' is not one of"), "{refused}");
}

#[test]
fn a_mistyped_argument_gets_one_line_though_all_nodes_get_it() {
    for name in ["dq_servo", "dq_dual_servo"] {
        for (arguments, named) in [
            (&["simm:=false"][..], "simm:=false"),
            (&["--arm"], "--arm"),
            (&["--bogus"], "--bogus"),
            (&["--ros-args", "--frob"], "--frob"),
        ] {
            let mut command = Command::new(script(name));
            command.env("DQ_SERVO", env!("CARGO_BIN_EXE_dq_servo")).args(arguments);
            let refused = command.timeout(std::time::Duration::from_secs(20)).assert().code(2);
            let stderr = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
            assert!(stderr.contains(named) && stderr.lines().count() == 1, "{name} {arguments:?}: {stderr}");
        }
    }
}

#[test]
fn the_script_starts_each_node_with_the_arm_that_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (program, started) = (folder.path().join("dq_servo"), folder.path().join("started"));
    // Each part ends when all three have been started.
    let part = format!(
        "#!/bin/sh\ncase \"$*\" in *--help) exit 0 ;; esac\necho \"$*\" >>{0}\nuntil [ $(wc -l <{0}) = 3 ]; do sleep 0.1; done\n",
        started.display()
    );
    std::fs::write(&program, part).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    for arm in [&["--arm", "ur5e"][..], &["arm:=ur5e"]] {
        let mut command = Command::new(script("dq_servo"));
        command.env("DQ_SERVO", &program).args(arm).args(["guard:=true", "--ros-args", "-r", "__ns:=/left"]);
        command.timeout(std::time::Duration::from_secs(10)).assert().success();
        let mut lines: Vec<_> =
            std::fs::read_to_string(&started).unwrap().lines().map(str::to_owned).collect();
        lines.sort();
        let of = |command, name| {
            format!("{command} --arm ur5e --ros-args --enclave /left/{name} -- --ros-args -r __ns:=/left")
        };
        assert_eq!(lines, [of("arm", "arm"), of("guard", "dq_servo_guard"), of("servo", "dq_servo")]);
        std::fs::remove_file(&started).unwrap();
    }
}

fn script(name: &str) -> String {
    format!("{}/launch_scripts/{name}.sh", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_scripts_have_their_own_help_and_end_with_the_code_of_the_part_that_failed() {
    for name in ["dq_servo", "dq_dual_servo"] {
        let help = Command::new(script(name)).arg("--help").assert().success().get_output().stdout.clone();
        assert!(String::from_utf8(help).unwrap().starts_with("Starts "));
        // The part that fails is first the one that starts first, and then the one that starts last.
        for failing in ["puma560", "servo|dual"] {
            let folder = tempfile::tempdir().unwrap();
            let program = folder.path().join("dq_servo");
            let ended = folder.path().join("ended");
            // It fails once the others are able to end on request.
            let parts = format!(
                "#!/bin/sh\ncase \"$*\" in *--help) exit 0 ;; esac\ntrap 'kill $!; echo $1 >>{}; exit 0' TERM\nsleep 10 &\ncase $1 in {failing}) sleep 0.3; kill $!; exit 7 ;; esac\nwait\n",
                ended.display()
            );
            std::fs::write(&program, parts).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
            let mut command = Command::new(script(name));
            command.env("DQ_SERVO", &program).timeout(std::time::Duration::from_secs(10)).assert().code(7);
            assert!(!std::fs::read_to_string(ended).unwrap().is_empty(), "the others were ended");
        }
    }
}

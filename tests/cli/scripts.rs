//! Tests the launch files and scripts.

use assert_cmd::Command;
use std::os::unix::fs::PermissionsExt;

#[test]
fn what_ros2_launch_needs_compiles_and_the_scripts_say_what_they_miss() {
    for name in ["dq_servo", "dq_dual_servo"] {
        let compile = format!("compile(open('launch_scripts/{name}.launch.py').read(), 'launch', 'exec')");
        Command::new("python3").args(["-c", &compile]).assert().success();
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

/// A substitute for the package `launch`, which no registry has: an action just stores its arguments.
const LAUNCH: &str = r#"
import sys, types

class StandIn(types.ModuleType):
    def __getattr__(self, name):
        if name == "LaunchDescription":
            return lambda actions: actions
        return lambda *values, **named: types.SimpleNamespace(is_a=name, values=values, **named)

for name in ("launch", "launch.actions", "launch.conditions", "launch.substitutions"):
    sys.modules[name] = StandIn(name)
code = {"__file__": sys.argv[1], "__name__": "launch_file"}
exec(open(sys.argv[1]).read(), code)
parts = [action for action in code["generate_launch_description"]() if action.is_a == "ExecuteProcess"]
runs, ends = types.SimpleNamespace(is_shutdown=False), types.SimpleNamespace(is_shutdown=True)
exit_of = lambda part, code, context=runs: part.on_exit(types.SimpleNamespace(returncode=code), context)
same = lambda part: (str(part.cmd), part.name)
for part in parts:
    for code, context in ((0, runs), (1, runs), (2, runs), (-9, runs), (4, ends)):
        assert exit_of(part, code, context).is_a == "Shutdown", (part.name, code)
    pauses = []
    for _ in range(8):
        timer = exit_of(part, 4)
        [again] = timer.actions
        assert timer.is_a == "TimerAction" and same(again) == same(part), (timer, part)
        part = again
        pauses.append(timer.period)
    assert pauses == [1, 2, 4, 8, 16, 30, 30, 30], pauses
print(len(parts))
"#;

#[test]
fn a_part_that_has_lost_the_network_is_launched_again_after_longer_and_longer_pauses_and_any_other_end_ends_all()
 {
    for (name, parts) in [("dq_servo", "3\n"), ("dq_dual_servo", "5\n")] {
        let file = format!("{}/launch_scripts/{name}.launch.py", env!("CARGO_MANIFEST_DIR"));
        Command::new("python3").args(["-c", LAUNCH, &file]).assert().success().stdout(parts);
    }
}

#[test]
fn a_mistyped_argument_gets_one_line_though_all_nodes_get_it() {
    for name in ["dq_servo", "dq_dual_servo"] {
        for (arguments, named) in [
            (&["simm:=false"][..], "simm:=false"),
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

fn script(name: &str) -> String {
    format!("{}/launch_scripts/{name}.sh", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_scripts_have_their_own_help_and_end_with_the_code_of_the_part_that_failed() {
    for name in ["dq_servo", "dq_dual_servo"] {
        let help = Command::new(script(name)).arg("--help").assert().success().get_output().stdout.clone();
        assert!(String::from_utf8(help).unwrap().starts_with("Starts "));
        // The failing part is once the first to start, and once the last.
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

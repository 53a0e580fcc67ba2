//! Tests the questions to a user at a terminal.

use crate::host::Host;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use std::time::{Duration, Instant};

#[test]
fn in_a_terminal_the_demo_waits_for_the_enter_key_and_prints_its_table() {
    let host = Host::new();
    let mut terminal = host.command("script");
    terminal.args([
        "--quiet",
        "--flush",
        "--return",
        "--command",
        env!("CARGO_BIN_EXE_dq_servo"),
        "/dev/null",
    ]);
    let mut demo = terminal.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let (mut keyboard, mut screen) =
        (demo.stdin.take().unwrap(), BufReader::new(demo.stdout.take().unwrap()));
    let mut line = String::new();
    while !line.contains("press Enter") {
        line.clear();
        assert_ne!(screen.read_line(&mut line).unwrap(), 0, "the demo has ended");
    }
    let waited = Instant::now();
    std::thread::sleep(Duration::from_millis(500));
    keyboard.write_all(b"\n").unwrap();
    let mut rest = String::new();
    screen.read_to_string(&mut rest).unwrap();
    assert!(waited.elapsed() < Duration::from_secs(50), "it has waited for a browser");
    assert!(demo.wait().unwrap().success(), "{rest}");
    assert!(rest.contains("Cycles woke late"), "{rest}");
}

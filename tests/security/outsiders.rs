//! Tests participants without keys. If everything is secured, they get nothing and change nothing. If nothing is secured, they get
//! everything.

use crate::host::{Host, PYTHON, assert_success};
use crate::insiders::{Site, run, start};
use crate::keystore::{Keystore, Variables, unsecured};
use dq_bags::Bag;
use serde_json::Value;

/// The time for which an outsider tries \[s\]. The positive controls show that this is long enough.
const SECONDS: u64 = 4;

/// The data that an outsider got.
#[derive(Debug, PartialEq)]
struct Loot {
    /// The topics of the servo from which the outsider read a message.
    topics: Vec<String>,
    /// Whether the outsider's service call was answered.
    answered: bool,
}

impl Loot {
    fn nothing() -> Self {
        Self { topics: Vec::new(), answered: false }
    }
}

/// Runs a participant of our own program with these variables. It records everything, publishes joint states of an arm with other
/// joint positions, and sets a parameter.
fn of_our_kind(host: &mut Host, variables: &Variables) -> Loot {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("loot");
    start(host, variables, "spy", &["record", "--out", path.to_str().unwrap()], "/dq_servo_recorder");
    let bent = "initial_positions:=[0.1,0.2,0.3,0.4,0.5,0.6]";
    start(host, variables, "impostor", &["puma560", "--ros-args", "-p", bent, "--"], "/puma560");
    let set = run(host, variables, &["param", "set", "controller", "diffc"], "/dq_servo_param");
    std::thread::sleep(std::time::Duration::from_secs(SECONDS));
    assert_eq!(host.interrupt("impostor").0, Some(0), "it could run");
    // Code 3 means that messages were lost. Messages that this process could not read count as lost.
    let code = host.interrupt("spy").0;
    assert!(matches!(code, Some(0 | 3)), "{code:?}");
    let mut heard: Vec<_> =
        Bag::open(&path).into_iter().flatten().map(|message| message.topic.to_string()).collect();
    heard.sort();
    heard.dedup();
    heard.retain(|name| SERVO_S.contains(&name.as_str()));
    Loot { topics: heard, answered: set.status.success() }
}

/// The topics that only the servo publishes, with or without a goal.
const SERVO_S: [&str; 3] = ["/dq_servo/current_pose", "/dq_servo/parameters", "/dq_servo/status"];

/// Runs a participant with another vendor's DDS, which reads, publishes commands and goals, and sets a parameter.
fn of_another_vendor(host: &Host) -> Loot {
    let mut command = host.command("timeout");
    let output = command.args(["60", PYTHON, crate::PEER, &SECONDS.to_string()]).output().unwrap();
    assert_success(&output);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let read = told["read"].as_object().unwrap().iter().filter(|(_, count)| count.as_u64() > Some(0));
    Loot {
        topics: read.map(|(topic, _)| topic.clone()).collect(),
        answered: told["answers"].as_u64() > Some(0),
    }
}

/// Returns the law that the servo uses.
fn law(site: &Site) -> String {
    let output = site.run(&["param", "get", "controller"], "/dq_servo_param");
    assert_success(&output);
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn outsiders_read_nothing_change_nothing_and_get_no_answer() {
    let (keystore, foreign) = (Keystore::new(), Keystore::new());
    let mut site = Site::new(keystore.variables());
    assert_eq!(of_our_kind(&mut site.host, &unsecured()), Loot::nothing(), "unsecured");
    assert_eq!(of_our_kind(&mut site.host, &foreign.variables()), Loot::nothing(), "of another authority");
    assert_eq!(of_another_vendor(&site.host), Loot::nothing(), "of another vendor");
    assert_eq!(law(&site), "logc");
    let seen = site.summary();
    assert!(seen.positions.len() > 1000, "the insiders went on: {}", seen.positions.len());
    assert_eq!(
        (seen.motion(), seen.goals),
        (0.0, 0),
        "the arm stood still, and nobody saw another arm or a goal"
    );
    // A joining participant may delay joint states for a moment, but changes nothing else.
    let idle = ["waiting_for_state", "holding", "stale_state"];
    assert!(seen.states.iter().all(|state| idle.contains(&state.as_str())), "{:?}", seen.states);
}

#[test]
fn an_outsider_that_runs_dq_servo_gets_everything_without_security() {
    let mut site = Site::new(unsecured());
    let loot = of_our_kind(&mut site.host, &unsecured());
    assert_eq!((loot.topics.len(), loot.answered), (SERVO_S.len(), true), "{loot:?}");
    assert_eq!(law(&site), "diffc");
    assert!(site.summary().motion() > 0.05, "the other arm was seen too");
}

#[test]
fn an_outsider_of_another_vendor_gets_everything_without_security() {
    let site = Site::new(unsecured());
    let loot = of_another_vendor(&site.host);
    assert_eq!((loot.topics.len(), loot.answered), (3, true), "{loot:?}");
    assert_eq!(law(&site), "diffc");
    let seen = site.summary();
    // The servo holds an arm that another publisher commands too, so each of those commands moves it for one cycle.
    assert!(seen.goals > 0 && seen.motion() > 0.01, "the arm moved {} rad", seen.motion());
}

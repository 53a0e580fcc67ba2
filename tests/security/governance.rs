//! Tests that governances are detected with which nodes on Fast DDS cannot be received.

use crate::fastdds::peer;
use crate::host::{Host, assert_success};
use crate::insiders::{Site, start};
use crate::keystore::Keystore;
use std::io::{BufRead, BufReader};

const NONE: &str = "<data_protection_kind>NONE";
const ENCRYPT: &str = "<data_protection_kind>ENCRYPT";

#[test]
fn a_governance_under_which_calls_hang_is_named_with_a_remedy_that_works() {
    let keystore = Keystore::new();
    // This is the governance that sros2 writes.
    keystore.govern(|own| own.replace(NONE, ENCRYPT));
    let warning = |site: &Site| {
        let output = site.run(&["param", "get", "controller"], "/dq_servo_param");
        assert_success(&output);
        String::from_utf8(output.stderr).unwrap()
    };
    let stops = |site: &Site| peer(site, &keystore.variables(), "stop", "/dq_servo_call").status.success();
    let site = Site::new(keystore.variables());
    let text = warning(&site);
    let file = keystore.path("enclaves/governance.p7s").canonicalize().unwrap();
    assert!(text.lines().count() == 1 && text.contains(file.to_str().unwrap()), "{text}");
    assert!(!stops(&site), "then the warning is needless");
    drop(site);
    let lines = ["metadata_protection_kind", "data_protection_kind"].map(|kind| {
        let from = &text[text.find(&format!("<{kind}>")).unwrap()..];
        format!("sed -i 's|<{kind}>.*|{}|' governance.xml; ", &from[..from.find(' ').unwrap()])
    });
    let command = text[text.find("openssl").unwrap()..].trim();
    keystore.shell(&format!("cd enclaves; {} {command}", lines.concat()));
    let site = Site::new(keystore.variables());
    assert_eq!(warning(&site), "");
    assert!(stops(&site));
}

/// Returns the topics about which a servo warns when it starts.
fn warned_of(keystore: &Keystore) -> Option<String> {
    let mut host = Host::new();
    let servo = start(&mut host, &keystore.variables(), "servo", &["servo"], "/dq_servo");
    let lines = BufReader::new(servo.stderr.as_mut().unwrap()).lines().map_while(Result::ok);
    let mut lines = lines.take_while(|line| !line.contains("waiting for joint states"));
    let warning = lines.find(|line| line.contains("[WARN] "))?;
    let (_, topics) = warning.split_once("data_protection_kind of the topics ")?;
    Some(topics.split_once(')')?.0.to_owned())
}

#[test]
fn the_rules_of_this_domain_count() {
    let rule_before = |own: &str, domains: &str| {
        let (from, to) = (own.find("<domain_rule>").unwrap(), own.find("</domain_rule>").unwrap() + 14);
        let range = "<id_range><min>0</min><max>232</max></id_range>";
        let before = own[from..to].replace(range, domains).replace(NONE, ENCRYPT);
        format!("{}{before}{}", &own[..from], &own[from..])
    };
    let topic_before = |own: &str, topic: &str, kind: &str| {
        let (from, to) = (own.find("<topic_rule>").unwrap(), own.find("</topic_rule>").unwrap() + 13);
        let before = own[from..to].replace('*', topic).replace(NONE, kind);
        format!("{}{before}{}", &own[..from], &own[from..])
    };
    type Change<'a> = &'a dyn Fn(&str) -> String;
    let cases: [(Change, Option<&str>); 6] = [
        (&|own| own.to_owned(), None),
        (&|own| topic_before(own, "rt/camera*", ENCRYPT), Some("rt/camera*")),
        (
            &|own| topic_before(own, "rq/*", "<data_protection_kind>SIGN").replace(NONE, ENCRYPT),
            Some("rq/*, *"),
        ),
        (&|own| rule_before(own, "<id>5</id><id_range><min>78</min></id_range>"), None),
        (&|own| rule_before(own, "<id>5</id><id>77</id>"), Some("*")),
        (&|own| rule_before(own, "<id_range><max>77</max></id_range>"), Some("*")),
    ];
    let whole = Keystore::new();
    for (change, expected) in cases {
        let keystore = whole.copy();
        keystore.govern(change);
        assert_eq!(warned_of(&keystore).as_deref(), expected);
    }
}

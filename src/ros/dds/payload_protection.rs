//! Warns of a DDS Security governance (`governance.p7s`) under which this process cannot receive from ROS 2 nodes on Fast DDS.
//!
//! `data_protection_kind` protects payloads in addition to the submessages that `metadata_protection_kind` protects. Fast DDS then
//! pads between ciphertext and signature, but RustDDS 0.15.1 takes the last 20 bytes as the signature. So RustDDS cannot read a
//! payload whose length is not a multiple of four (`payload_padding` handles our side). The reliable reader waits for that payload
//! forever and withholds all later ones, so service calls hang. sros2 writes such a governance. Delete this module when test
//! `security` a_governance_under_which_… fails because the service call succeeds ("then the warning is needless").

use openssl::pkcs7::Pkcs7;
use roxmltree::{Document, Node};
use std::path::Path;

/// Returns a warning if the signed governance in `file` protects payloads in this domain. RustDDS has already verified the file.
pub(crate) fn warning(file: &Path, domain: u16) -> Option<String> {
    let (_, signed) = Pkcs7::from_smime(&std::fs::read(file).ok()?).ok()?;
    let text = String::from_utf8(signed?).ok()?;
    let document = Document::parse(text.get(text.find('<')?..)?).ok()?;
    let topics = protected_topics(&document, domain);
    // Each enclave has a link to the file that must be changed.
    let file = file.canonicalize().unwrap_or_else(|_| file.to_owned());
    (!topics.is_empty()).then(|| {
        format!(
            "security: {} protects payloads once more (data_protection_kind of the topics {}), so that calls and strings from \
             ROS 2 nodes on Fast DDS hang or get lost here. In the governance.xml beside it change two lines, \
             <metadata_protection_kind>ENCRYPT</metadata_protection_kind> <data_protection_kind>NONE</data_protection_kind> \
             (all stays encrypted), and there sign it again: openssl smime -sign -text -md sha256 -in governance.xml -out \
             governance.p7s -signer ../public/permissions_ca.cert.pem -inkey ../private/permissions_ca.key.pem",
            file.display(),
            topics.join(", ")
        )
    })
}

/// Returns the topic expressions whose payloads are protected. The first rule that names the domain applies.
fn protected_topics<'a>(governance: &'a Document, domain: u16) -> Vec<&'a str> {
    let mut rules = governance.descendants().filter(|node| node.has_tag_name("domain_rule"));
    let counts =
        |rule: &Node| rule.children().any(|child| child.has_tag_name("domains") && names(child, domain));
    let rule = rules.find(counts);
    let topics =
        rule.into_iter().flat_map(|rule| rule.descendants()).filter(|it| it.has_tag_name("topic_rule"));
    let protected =
        topics.filter(|topic| text(*topic, "data_protection_kind").is_some_and(|kind| kind != "NONE"));
    protected.filter_map(|topic| text(topic, "topic_expression")).collect()
}

/// Returns whether a list of domain ids and ranges contains `domain`. A range may lack a bound.
fn names(domains: Node, domain: u16) -> bool {
    let bound = |range, name| text(range, name).and_then(|number| number.parse::<u16>().ok());
    domains.children().any(|entry| match entry.tag_name().name() {
        "id" => entry.text().is_some_and(|id| id.trim().parse() == Ok(domain)),
        "id_range" => {
            bound(entry, "min").is_none_or(|min| min <= domain)
                && bound(entry, "max").is_none_or(|max| domain <= max)
        }
        _ => false,
    })
}

fn text<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.children().find(|child| child.has_tag_name(name))?.text().map(str::trim)
}

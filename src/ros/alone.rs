//! For tests of participants that meet nobody but each other.

pub use crate::dds::alone::outside;

use super::{Environment, LogLevel, Logging, Node, Reach, Resolver, RosArgs, Session};

pub fn node(name: &str) -> (Session, Node) {
    let session = session();
    let names = Resolver::new(name, &RosArgs::default()).unwrap();
    let node = session.node(names, Logging::new(&RosArgs::default(), LogLevel::Info)).unwrap();
    (session, node)
}

/// A participant of its own.
pub fn session() -> Session {
    let environment = Environment { domain_id: 7, reach: Reach::Localhost, enclave: None };
    Session::open(&environment).unwrap()
}

//! Who is let in: the checks of Host, Origin and token.
//!
//! A page of another site can make its visitor's browser connect to this server, under a name that it lets point here (DNS rebinding).
//! What such a page cannot do is to name this host in `Host`, or its own `Origin` away.

use hyper::HeaderMap;
use hyper::header::{HOST, HeaderName, ORIGIN};
use std::net::{IpAddr, SocketAddr};
use thiserror::Error;

/// Why a request is refused.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub(super) enum Refusal {
    /// Another name than this host's.
    #[error("the Host is not this server's")]
    Host,
    /// Another page's script.
    #[error("the Origin is not this server's")]
    Origin,
}

/// Whom the server answers to.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    /// The host as it was given to listen on; an address, or a name.
    name: String,
    /// Whether it listens on loopback only.
    loopback: bool,
    /// Without it nobody gets in, where there is one.
    token: Option<String>,
}

impl Guard {
    /// For a server at `address`, which was asked for as `name`. Beyond loopback a token is needed.
    ///
    /// # Errors
    /// The operating system's, where it gives no random numbers.
    pub fn new(name: &str, address: SocketAddr) -> std::io::Result<Self> {
        let loopback = address.ip().is_loopback();
        let token = if loopback { None } else { Some(random_token()?) };
        Ok(Self { name: name.to_ascii_lowercase(), loopback, token })
    }

    /// The token, where one is needed.
    pub fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Whether `given` is the token, or none is needed. Takes as long for a near miss as for any other.
    pub fn admits(&self, given: Option<&str>) -> bool {
        let Some(token) = self.token.as_deref() else { return true };
        let given = given.unwrap_or_default();
        let difference = token.bytes().zip(given.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        token.len() == given.len() && difference == 0
    }

    /// Checks the headers of a request, and returns its `Host`. A browser's script always names its `Origin` where it opens a WebSocket; who is no browser
    /// need not.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn check<'a>(&self, headers: &'a HeaderMap) -> Result<&'a str, Refusal> {
        let host = single(headers, HOST).filter(|host| self.is_ours(host)).ok_or(Refusal::Host)?;
        match headers.contains_key(ORIGIN) {
            false => Ok(host),
            true => single(headers, ORIGIN)
                .and_then(|origin| origin.strip_prefix("http://"))
                .filter(|origin| origin.eq_ignore_ascii_case(host))
                .map(|_| host)
                .ok_or(Refusal::Origin),
        }
    }

    /// Whether a `Host` is this server: its address, `localhost`, or the name it was asked to listen on. The port is not looked at,
    /// since a tunnel (`ssh -L`) may change it.
    fn is_ours(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        let name = name.to_ascii_lowercase();
        match name.parse::<IpAddr>() {
            Ok(address) => !self.loopback || address.is_loopback(),
            Err(_) => name == "localhost" || name == self.name,
        }
    }
}

/// The header's value, where it is there once.
fn single(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

/// `a:1` is `a`, `[::1]:1` is `::1`; none where what follows is no port.
fn without_port(host: &str) -> Option<&str> {
    let (name, rest) = match host.strip_prefix('[') {
        Some(bracketed) => bracketed.split_once(']')?,
        None => host.split_at(host.find(':').unwrap_or(host.len())),
    };
    let is_port = |port: &str| port.bytes().all(|byte| byte.is_ascii_digit());
    (rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port)).then_some(name)
}

/// 128 bits of the operating system's randomness, in hexadecimal.
fn random_token() -> std::io::Result<String> {
    let mut bytes = [0; 16];
    std::io::Read::read_exact(&mut std::fs::File::open("/dev/urandom")?, &mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(name: &str, address: &str) -> Guard {
        Guard::new(name, address.parse().unwrap()).unwrap()
    }

    fn check(guard: &Guard, headers: &[(HeaderName, &str)]) -> Result<(), Refusal> {
        let pairs = headers.iter().map(|(name, value)| (name.clone(), value.parse().unwrap()));
        let mut map = HeaderMap::new();
        for (name, value) in pairs {
            map.append(name, value);
        }
        guard.check(&map).map(|_| ())
    }

    #[test]
    fn only_names_of_this_server_are_hosts() {
        let loopback = guard("127.0.0.1", "127.0.0.1:8123");
        for ours in
            ["127.0.0.1:8123", "localhost:8123", "LOCALHOST", "localhost:9000", "[::1]:8123", "127.0.0.1"]
        {
            assert_eq!(check(&loopback, &[(HOST, ours)]), Ok(()), "{ours}");
        }
        for foreign in [
            "evil.example",
            "localhost.evil.example:8123",
            "192.168.1.7:8123",
            "127.0.0.1.evil.example",
            "",
            "[",
            "0x7f.1",
            "localhost:80; script-src *",
            "[::1]8123",
        ] {
            assert_eq!(check(&loopback, &[(HOST, foreign)]), Err(Refusal::Host), "{foreign}");
        }
        assert_eq!(check(&loopback, &[]), Err(Refusal::Host));
        let twice = [(HOST, "localhost"), (HOST, "evil.example")];
        assert_eq!(check(&loopback, &twice), Err(Refusal::Host));
        let network = guard("Robot.local", "192.168.1.7:8123");
        for ours in ["192.168.1.7:8123", "robot.local:8123", "10.0.0.1"] {
            assert_eq!(check(&network, &[(HOST, ours)]), Ok(()), "{ours}");
        }
        assert_eq!(check(&network, &[(HOST, "evil.example")]), Err(Refusal::Host));
    }

    #[test]
    fn a_script_of_another_page_is_refused() {
        let guard = guard("127.0.0.1", "127.0.0.1:8123");
        let from = |origin| check(&guard, &[(HOST, "localhost:8123"), (ORIGIN, origin)]);
        assert_eq!(from("http://localhost:8123"), Ok(()));
        for foreign in [
            "http://evil.example",
            "http://localhost:9999",
            "http://127.0.0.1:8123",
            "null",
            "https://localhost:8123",
            "",
        ] {
            assert_eq!(from(foreign), Err(Refusal::Origin), "{foreign}");
        }
    }

    #[test]
    fn beyond_loopback_the_token_admits_and_nothing_else_does() {
        assert!(guard("localhost", "127.0.0.1:1").admits(None));
        let (one, other) = (guard("0.0.0.0", "0.0.0.0:1"), guard("0.0.0.0", "0.0.0.0:1"));
        let token = one.token().unwrap();
        assert_eq!(token.len(), 32);
        assert_ne!(one.token(), other.token());
        assert!(one.admits(Some(token)));
        for wrong in [None, Some(""), Some(&token[1..]), other.token()] {
            assert!(!one.admits(wrong), "{wrong:?}");
        }
    }
}

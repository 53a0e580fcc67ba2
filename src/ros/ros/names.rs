//! The rules for ROS 2 names.

use thiserror::Error;

/// A text that is not a valid ROS 2 name.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name:?} is not a valid {kind}: {why}")]
pub struct NameError {
    /// The invalid text.
    pub name: String,
    /// The kind of name that was expected.
    pub kind: &'static str,
    /// The reason, or the expected form.
    pub why: &'static str,
}

/// A node's name and namespace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeName {
    namespace: String,
    name: String,
}

impl NodeName {
    /// Creates a name from a namespace (`/` or `/a/b`; a missing leading slash is added) and a name.
    ///
    /// # Errors
    /// [`NameError`] if either is invalid.
    pub fn new(namespace: &str, name: &str) -> Result<Self, NameError> {
        check_token(name, name, "node name")?;
        let namespace = format!("/{}", namespace.trim_start_matches('/'));
        if namespace != "/" {
            check_absolute(&namespace, "namespace")?;
        }
        Ok(Self { namespace, name: name.to_owned() })
    }

    /// Parses a fully qualified name. A name without a slash is in `/`.
    ///
    /// # Errors
    /// [`NameError`] if the name is invalid.
    pub fn parse(text: &str) -> Result<Self, NameError> {
        let (namespace, name) = text.rsplit_once('/').unwrap_or(("/", text));
        Self::new(namespace, name)
    }

    /// Returns the namespace, `/` for the root.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// Returns the name without its namespace.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the namespace and the name.
    pub fn fully_qualified(&self) -> String {
        join(&self.namespace, &self.name)
    }
}

/// Joins a namespace and a name.
pub(super) fn join(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// Checks the name of an enclave: `/`, or a fully qualified name such as `/a/b`.
pub(super) fn check_enclave(name: &str) -> Result<(), NameError> {
    match name {
        "/" => Ok(()),
        _ if name.starts_with('/') => check_absolute(name, "enclave"),
        _ => Err(NameError { name: name.to_owned(), kind: "enclave", why: "expected a slash first" }),
    }
}

/// Checks a fully qualified name. `kind` says in errors what the name is, for example "enclave".
pub(super) fn check_absolute(name: &str, kind: &'static str) -> Result<(), NameError> {
    if name.len() > 247 {
        return Err(NameError { name: name.to_owned(), kind, why: "longer than 247 characters" });
    }
    name.trim_start_matches('/').split('/').try_for_each(|token| check_token(token, name, kind))?;
    // ROS 2 allows only one leading slash.
    match name.starts_with("//") {
        true => Err(NameError { name: name.to_owned(), kind, why: "a slash too many" }),
        false => Ok(()),
    }
}

fn check_token(token: &str, name: &str, kind: &'static str) -> Result<(), NameError> {
    let error = |why| Err(NameError { name: name.to_owned(), kind, why });
    match token.chars().next() {
        None => error("empty, or a slash too many"),
        Some(first) if first.is_ascii_digit() => error("a part begins with a digit"),
        _ if !token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
            error("expected letters, digits, underscores and slashes only")
        }
        _ if token.contains("__") => error("two underscores in a row"),
        _ => Ok(()),
    }
}

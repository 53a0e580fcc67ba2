//! An enclave's files: whether this process may be who they say, before it says so to anybody.
//!
//! RustDDS looks at no certificate's dates, nor whether key and certificate belong together: the first would let a node go
//! on for ever, the second would leave it without a peer and without a word. So both are looked at here.

use super::error::RosError;
use super::governance;
use openssl::asn1::{Asn1Time, Asn1TimeRef};
use openssl::error::ErrorStack;
use openssl::pkey::PKey;
use openssl::x509::X509;
use rustdds::dds::CreateError;
use rustdds::{DomainParticipant, DomainParticipantBuilder, DomainParticipantSecurityConfigFiles};
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A participant, called `what` in errors, with the keys and permissions in the folder `enclave`, whose files have sros2's
/// names; and what its operator should know of the governance, if anything.
///
/// # Errors
/// [`RosError::Security`] for the first file that is missing, wrong or out of date, [`RosError::Create`].
pub(super) fn participant(
    builder: DomainParticipantBuilder,
    enclave: &Path,
    domain: u16,
    what: &str,
) -> Result<(DomainParticipant, Option<String>), RosError> {
    check(enclave)?;
    let files = DomainParticipantSecurityConfigFiles::with_ros_default_names(enclave, String::new());
    let participant = builder.builtin_security(files).build().map_err(|why| match why {
        CreateError::NotAllowedBySecurity { reason } => refuse(enclave)(&reason),
        other => RosError::create(what)(&other),
    })?;
    Ok((participant, governance::warning(&enclave.join("governance.p7s"), domain)))
}

/// Checks the files, but for the signed documents, which RustDDS checks.
fn check(enclave: &Path) -> Result<(), RosError> {
    let now = Asn1Time::days_from_now(0).map_err(|why| refuse(enclave)(&why))?;
    let [own, identity_ca, _permissions_ca] = [
        certificate(enclave.join("cert.pem"), &now)?,
        certificate(enclave.join("identity_ca.cert.pem"), &now)?,
        certificate(enclave.join("permissions_ca.cert.pem"), &now)?,
    ];
    for document in ["governance.p7s", "permissions.p7s"] {
        read(&enclave.join(document))?;
    }
    if !is_signed(&own, &identity_ca).unwrap_or(false) {
        return Err(refuse(&enclave.join("cert.pem"))(&"not signed by identity_ca.cert.pem beside it"));
    }
    let key = enclave.join("key.pem");
    if !is_key(&read(&key)?, &own).map_err(|why| refuse(&key)(&format!("no private key: {why}")))? {
        return Err(refuse(&key)(&"not the key of cert.pem beside it"));
    }
    Ok(())
}

fn certificate(path: PathBuf, now: &Asn1TimeRef) -> Result<X509, RosError> {
    let certificate =
        X509::from_pem(&read(&path)?).map_err(|why| refuse(&path)(&format!("no certificate: {why}")))?;
    let (first, last) = (certificate.not_before(), certificate.not_after());
    if now < first {
        return Err(refuse(&path)(&format!("the certificate is not valid before {first}")));
    }
    if now > last {
        return Err(refuse(&path)(&format!("the certificate expired on {last}")));
    }
    Ok(certificate)
}

fn is_signed(certificate: &X509, authority: &X509) -> Result<bool, ErrorStack> {
    certificate.verify(&*authority.public_key()?)
}

fn is_key(pem: &[u8], certificate: &X509) -> Result<bool, ErrorStack> {
    // A callback, or OpenSSL would ask the terminal for the password of an encrypted key.
    let key = PKey::private_key_from_pem_callback(pem, |_| Ok(0))?;
    Ok(certificate.public_key()?.public_eq(&key))
}

fn read(path: &Path) -> Result<Vec<u8>, RosError> {
    std::fs::read(path).map_err(|why| refuse(path)(&why))
}

fn refuse(path: &Path) -> impl FnOnce(&dyn Display) -> RosError {
    let path = path.to_owned();
    move |why| RosError::Security { path, why: why.to_string() }
}

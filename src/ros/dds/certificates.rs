//! Checks the files of an enclave before this process uses them in the graph.
//!
//! RustDDS 0.15.1 checks neither the dates of certificates nor whether key and certificate belong together. Without the check of
//! the dates, a node would continue after its certificate has expired. Without the check of the key, the node would find no peer
//! and report nothing. Delete this module when test `security` an_enclave_s_own_files_… passes without the module.

use openssl::asn1::{Asn1Time, Asn1TimeRef};
use openssl::error::ErrorStack;
use openssl::pkey::PKey;
use openssl::x509::X509;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A file or folder of an enclave that is missing, invalid or out of date.
pub(crate) struct Unusable {
    pub path: PathBuf,
    pub why: String,
}

/// Checks the files in the folder `enclave`. The files have the names that sros2 gives them. This function checks only that the
/// signed documents can be read; RustDDS verifies their signatures.
///
/// # Errors
/// [`Unusable`] for the first file that fails.
pub(crate) fn check(enclave: &Path) -> Result<(), Unusable> {
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

fn certificate(path: PathBuf, now: &Asn1TimeRef) -> Result<X509, Unusable> {
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
    // Without this callback OpenSSL would ask the terminal for the password of an encrypted key.
    let key = PKey::private_key_from_pem_callback(pem, |_| Ok(0))?;
    Ok(certificate.public_key()?.public_eq(&key))
}

fn read(path: &Path) -> Result<Vec<u8>, Unusable> {
    std::fs::read(path).map_err(|why| refuse(path)(&why))
}

fn refuse(path: &Path) -> impl FnOnce(&dyn Display) -> Unusable {
    let path = path.to_owned();
    move |why| Unusable { path, why: why.to_string() }
}

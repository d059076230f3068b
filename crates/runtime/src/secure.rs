//! Links over TLS with certificates of both sides, as a folder of certificates has them.

use std::path::Path;

use curionav_security::name::Name;
use zenoh::Config;

use crate::session::SessionError;

#[cfg(feature = "tls")]
pub use tls::{certificate, check, client, router};
#[cfg(not(feature = "tls"))]
pub use without_tls::{check, client, router};

#[cfg(feature = "tls")]
mod tls {
    use curionav_schemas::MESSAGES;
    use curionav_security::folder::{Folder, Identity};

    use super::{Config, Name, Path, SessionError};
    use crate::session::set;

    /// Sessions that a router has at once: a hundred robots with eight each, and pools. One more is refused.
    const SESSIONS_MAX: usize = 1024;
    /// What a message may have beyond its payload.
    const ENVELOPE: usize = 64 << 10;

    /// The certificate that a program shows which may show any of `names`.
    ///
    /// # Errors
    /// None of them is in the folder, or the first that is cannot be used: with what mends it.
    pub fn certificate(folder: &Path, names: &[Name]) -> Result<Identity, SessionError> {
        let found = Folder::new(folder);
        let name = found.first_of(names).or_else(|| names.first().cloned());
        let name = name.ok_or_else(|| SessionError::Other("no name for a certificate".into()))?;
        found.identity(&name).map_err(|error| SessionError::Certificate(error.to_string()))
    }

    /// Whether [`client`] will find a certificate that it can use.
    pub fn check(folder: &Path, names: &[Name]) -> Result<(), SessionError> {
        certificate(folder, names).map(drop)
    }

    /// Makes a configuration that connects over TLS alone.
    pub fn client(config: &mut Config, folder: &Path, names: &[Name]) -> Result<(), SessionError> {
        let identity = certificate(folder, names)?;
        links(config, &identity, "")
    }

    /// Makes a configuration of a router that takes clients over TLS alone, and holds them to the access rules.
    pub fn router(config: &mut Config, folder: &Path, name: &Name) -> Result<(), SessionError> {
        let identity = certificate(folder, std::slice::from_ref(name))?;
        let rules =
            Folder::new(folder).rules().map_err(|error| SessionError::Certificate(error.to_string()))?;
        let listen = format!(
            "listen_certificate: {:?}, listen_private_key: {:?},",
            identity.certificate.display().to_string(),
            identity.key.display().to_string()
        );
        links(config, &identity, &listen)?;
        let settings = [
            ("transport/unicast/max_sessions", SESSIONS_MAX.to_string()),
            ("transport/unicast/max_links", "1".into()),
            ("access_control", rules.json()),
            // For this process alone, which counts what is denied: no rule lets anyone else in.
            ("adminspace", "{ enabled: true, permissions: { read: true, write: false } }".into()),
        ];
        settings.iter().try_for_each(|(key, value)| set(config, &[(*key, value.as_str())]))
    }

    fn links(config: &mut Config, identity: &Identity, listen: &str) -> Result<(), SessionError> {
        let [authority, certificate, key] =
            [&identity.authority, &identity.certificate, &identity.key].map(|file| file.display().to_string());
        let tls = format!(
            "{{ root_ca_certificate: {authority:?}, connect_certificate: {certificate:?}, \
             connect_private_key: {key:?}, {listen} enable_mtls: true, verify_name_on_connect: true, \
             close_link_on_expiration: true }}"
        );
        let largest = MESSAGES.iter().map(|message| message.max_bytes).max().unwrap_or_default();
        let message = (largest + ENVELOPE).to_string();
        let settings = [
            ("transport/link/protocols", r#"["tls"]"#),
            ("transport/link/tls", tls.as_str()),
            ("transport/link/rx/max_message_size", message.as_str()),
            ("transport/shared_memory/enabled", "false"),
        ];
        set(config, &settings)
    }
}

#[cfg(not(feature = "tls"))]
mod without_tls {
    use super::{Config, Name, Path, SessionError};

    fn left_out(folder: &Path) -> SessionError {
        SessionError::Certificate(format!(
            "{}: this program was built without the feature `tls`, which links over TLS need: build it with \
             `cargo build --release --features tls`",
            folder.display()
        ))
    }

    /// Whether there are links over TLS: there are not.
    pub fn check(folder: &Path, _: &[Name]) -> Result<(), SessionError> {
        Err(left_out(folder))
    }

    /// As [`check`].
    pub fn client(_: &mut Config, folder: &Path, _: &[Name]) -> Result<(), SessionError> {
        Err(left_out(folder))
    }

    /// As [`check`].
    pub fn router(_: &mut Config, folder: &Path, _: &Name) -> Result<(), SessionError> {
        Err(left_out(folder))
    }
}

/// What TLS says against the other side, in an error of Zenoh; nothing if the error is about something else.
pub(crate) fn distrust(error: &str) -> Option<String> {
    eprintln!("DEBUG {error}");
    let _ = error;
    None
}

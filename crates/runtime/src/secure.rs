//! Links over TLS with certificates of both sides, as a folder of certificates has them.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use curionav_schemas::MESSAGES;
use curionav_security::folder::{Folder, Identity};
use curionav_security::name::Name;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::{AlertDescription, CertificateError, ClientConfig, ClientConnection, RootCertStore, Stream};
use zenoh::Config;

use crate::session_error::{SessionError, set};

/// Sessions that a router has at once: a hundred robots with eight each, and pools. One more is refused.
const SESSIONS_MAX: usize = 1024;
/// Protocols of links.
const LINKS: &str = r#"["tls"]"#;
/// The same where a socket of the host is safe as well.
const LINKS_ON_ONE_HOST: &str = r#"["tls", "unixsock-stream"]"#;
/// Where systemd says in which folder the files are that `LoadCredential=` hands to a unit.
const HANDED: &str = "CREDENTIALS_DIRECTORY";
/// What a message may have beyond its payload.
const ENVELOPE: usize = 64 << 10;

/// The certificate that a program shows which may show any of `names`.
///
/// # Errors
/// None of them is in the folder, or the first that is cannot be used: with what mends it.
pub fn certificate(folder: &Path, names: &[Name]) -> Result<Identity, SessionError> {
    let handed = std::env::var_os(HANDED).map(PathBuf::from);
    let found = Folder::new(folder).with_keys(handed);
    let name = found.first_of(names).or_else(|| names.first().cloned());
    let name = name.ok_or_else(|| SessionError::Other("no name for a certificate".into()))?;
    found.identity(&name).map_err(|error| SessionError::Input(error.to_string()))
}

/// The name under which a program shows itself that may use any of `names`.
pub fn shown(folder: &Path, names: &[Name]) -> Option<Name> {
    Folder::new(folder).first_of(names)
}

/// Until when the certificate of `name` is valid, as a part of a sentence.
pub fn until(folder: &Path, name: &Name) -> String {
    let read = Folder::new(folder).read(&name.to_string());
    read.map_or_else(
        |_| String::new(),
        |certificate| {
            let due = if certificate.is_due() { ", so renew it: curionav secure renew" } else { "" };
            format!("; valid until {}{due}", certificate.until())
        },
    )
}

/// Whether [`client`] will find a certificate that it can use.
pub fn check(folder: &Path, names: &[Name]) -> Result<(), SessionError> {
    certificate(folder, names).map(drop)
}

/// Makes a configuration that connects over TLS, or through a socket of this host, alone.
pub fn client(config: &mut Config, folder: &Path, names: &[Name]) -> Result<(), SessionError> {
    let identity = certificate(folder, names)?;
    links(config, &identity, "", LINKS_ON_ONE_HOST)
}

/// Makes a configuration of a router that takes clients over TLS alone, and holds them to the access rules.
pub fn router(config: &mut Config, folder: &Path, name: &Name) -> Result<(), SessionError> {
    let identity = certificate(folder, std::slice::from_ref(name))?;
    let rules = Folder::new(folder).rules().map_err(|error| SessionError::Input(error.to_string()))?;
    // The router on a robot also takes the robot's own programs, through a socket on its host.
    let (rules, protocols) = match name.robot() {
        Some(robot) => (rules.with_socket(robot), LINKS_ON_ONE_HOST),
        None => (rules, LINKS),
    };
    let listen = format!(
        "listen_certificate: {:?}, listen_private_key: {:?},",
        identity.certificate.display().to_string(),
        identity.key.display().to_string()
    );
    links(config, &identity, &listen, protocols)?;
    let settings = [
        ("transport/unicast/max_sessions", SESSIONS_MAX.to_string()),
        ("transport/unicast/max_links", "1".into()),
        ("access_control", rules.json()),
        // For this process alone, which counts what is denied: no rule lets anyone else in.
        ("adminspace", "{ enabled: true, permissions: { read: true, write: false } }".into()),
    ];
    settings.iter().try_for_each(|(key, value)| set(config, &[(*key, value.as_str())]))
}

/// How long a router may take to answer a greeting. One that is content says nothing.
const GREETING: Duration = Duration::from_millis(500);

/// Why the router at `endpoint` and the holder of a certificate do not trust each other; nothing if they do, or if
/// no router is there. Zenoh itself only logs it. Blocks for a second at most.
pub fn distrust(endpoint: &str, folder: &Path, names: &[Name]) -> Option<String> {
    let identity = certificate(folder, names).ok()?;
    let address = endpoint.strip_prefix("tls/")?.split(['?', '#']).next()?;
    let host = address.rsplit_once(':')?.0.trim_start_matches('[').trim_end_matches(']');
    match greet(address, host, &identity) {
        Err(Failure::Tls(error)) => Some(in_words(&error, host, &identity)),
        _ => None,
    }
}

/// Whether what listens at `address` answers a greeting over TLS. Blocks for a second at most.
pub(crate) fn speaks_tls(address: &str) -> bool {
    /// The first two bytes of a handshake or an alert: what kind of record, and the version's first half.
    const RECORDS: [[u8; 2]; 2] = [[22, 3], [21, 3]];
    let mut answer = [0; 2];
    let is_answered = anonymous_greeting(address, &mut answer).is_ok();
    is_answered && RECORDS.contains(&answer)
}

fn anonymous_greeting(address: &str, answer: &mut [u8]) -> Result<(), Failure> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_root_certificates(RootCertStore::empty())
        .with_no_client_auth();
    let anyone = ServerName::try_from("localhost").map_err(|_| Failure::Other)?;
    let mut connection = ClientConnection::new(Arc::new(config), anyone)?;
    let mut socket = connected(address)?;
    connection.write_tls(&mut socket)?;
    Ok(socket.read_exact(answer)?)
}

/// A socket whose every step takes no longer than a greeting may.
fn connected(address: &str) -> Result<TcpStream, Failure> {
    let resolved = address.to_socket_addrs()?.next().ok_or(Failure::Other)?;
    let socket = TcpStream::connect_timeout(&resolved, GREETING)?;
    socket.set_read_timeout(Some(GREETING))?;
    socket.set_write_timeout(Some(GREETING))?;
    Ok(socket)
}

enum Failure {
    Tls(rustls::Error),
    Other,
}

impl From<rustls::Error> for Failure {
    fn from(error: rustls::Error) -> Self {
        Self::Tls(error)
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<rustls::Error>());
        inner.map_or(Self::Other, |tls| Self::Tls(tls.clone()))
    }
}

/// A handshake, and then a moment in which the router may object.
fn greet(address: &str, host: &str, identity: &Identity) -> Result<(), Failure> {
    let unreadable = |_| Failure::Other;
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(&identity.authority).map_err(unreadable)?)?;
    let own = CertificateDer::from_pem_file(&identity.certificate).map_err(unreadable)?;
    let key = PrivateKeyDer::from_pem_file(&identity.key).map_err(unreadable)?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_root_certificates(roots)
        .with_client_auth_cert(vec![own], key)?;
    let host = ServerName::try_from(host.to_owned()).map_err(|_| Failure::Other)?;
    let mut connection = ClientConnection::new(Arc::new(config), host)?;
    let mut socket = connected(address)?;
    let mut stream = Stream::new(&mut connection, &mut socket);
    stream.flush()?;
    match stream.read(&mut [0]) {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(()),
        read => Ok(read.map(drop)?),
    }
}

fn in_words(error: &rustls::Error, host: &str, identity: &Identity) -> String {
    let name = &identity.name;
    let authority = identity.authority.display();
    match error {
        rustls::Error::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => {
            format!(
                "the router's certificate is not signed by the authority in {authority}; copy ca.pem from where it was issued"
            )
        }
        rustls::Error::InvalidCertificate(
            CertificateError::Expired | CertificateError::ExpiredContext { .. },
        ) => "the router's certificate has expired; renew it and restart the router".into(),
        rustls::Error::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
        ) => format!(
            "the router's certificate is not for `{host}`; connect by another name, or issue it with --address {host}"
        ),
        rustls::Error::AlertReceived(
            AlertDescription::UnknownCA | AlertDescription::DecryptError | AlertDescription::BadCertificate,
        ) => format!(
            "the router does not know the authority that has signed the certificate `{name}`; issue it with the router's authority"
        ),
        rustls::Error::AlertReceived(AlertDescription::CertificateExpired) => {
            format!("for the router, the certificate `{name}` has expired; renew it, or set the clocks")
        }
        error => format!("{error} (with the certificate `{name}`)"),
    }
}

fn links(
    config: &mut Config,
    identity: &Identity,
    listen: &str,
    protocols: &str,
) -> Result<(), SessionError> {
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
        ("transport/link/protocols", protocols),
        ("transport/link/tls", tls.as_str()),
        ("transport/link/rx/max_message_size", message.as_str()),
        ("transport/shared_memory/enabled", "false"),
    ];
    set(config, &settings)
}

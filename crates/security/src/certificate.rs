//! Certificates: made with `rcgen`, read with `x509-parser`.

use std::net::IpAddr;
use std::time::Duration;

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose, SanType,
};
use time::OffsetDateTime;
use x509_parser::extensions::GeneralName;
use x509_parser::pem::parse_x509_pem;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::name::Name;

/// Clocks of machines need not agree better than this.
const CLOCKS_DIFFER: Duration = Duration::from_secs(300);

/// Before the name of a robot that a certificate lists, in a URI of its own.
const LISTED: &str = "curionav:robot/";

/// A certificate and its key, both in PEM.
pub(crate) struct Made {
    pub(crate) certificate: String,
    pub(crate) key: String,
}

fn params(common_name: &str, addresses: &[String], lifetime: Duration) -> Result<CertificateParams, String> {
    let mut params = CertificateParams::new(addresses.to_vec()).map_err(|error| error.to_string())?;
    let now = OffsetDateTime::now_utc();
    params.not_before = now - CLOCKS_DIFFER;
    params.not_after = now + lifetime;
    params.distinguished_name = rcgen::DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, common_name);
    params.use_authority_key_identifier_extension = true;
    Ok(params)
}

/// A new authority, which signs certificates and nothing else.
pub(crate) fn authority(lifetime: Duration) -> Result<Made, String> {
    let mut params = params("curionav", &[], lifetime)?;
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    let key = KeyPair::generate().map_err(|error| error.to_string())?;
    let certificate = params.self_signed(&key).map_err(|error| error.to_string())?;
    Ok(Made { certificate: certificate.pem(), key: key.serialize_pem() })
}

/// A certificate for `name`, signed by the authority. With `key`, which is kept, or with a new one.
pub(crate) fn signed(
    authority: &Made,
    name: &Name,
    addresses: &[String],
    lifetime: Duration,
    key: Option<&str>,
) -> Result<Made, String> {
    let key = key.map_or_else(KeyPair::generate, KeyPair::from_pem).map_err(|e| e.to_string())?;
    let mut params = params(&name.to_string(), addresses, lifetime)?;
    for robot in name.robots() {
        let listed = format!("{LISTED}{robot}").try_into();
        params.subject_alt_names.push(SanType::URI(listed.map_err(|error: rcgen::Error| error.to_string())?));
    }
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
    // Nothing but a router listens, so that no service can pass for one.
    if name.is_router() {
        params.extended_key_usages.push(ExtendedKeyUsagePurpose::ServerAuth);
    }
    let signer = KeyPair::from_pem(&authority.key).map_err(|e| e.to_string())?;
    let issuer = Issuer::from_ca_cert_pem(&authority.certificate, signer).map_err(|e| e.to_string())?;
    let certificate = params.signed_by(&key, &issuer).map_err(|e| e.to_string())?;
    Ok(Made { certificate: certificate.pem(), key: key.serialize_pem() })
}

/// What a certificate says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certificate {
    /// The common name, which need not be one of ours.
    pub common_name: String,
    /// Valid from then on, seconds since 1970.
    pub not_before: i64,
    /// Valid until then, seconds since 1970.
    pub not_after: i64,
    /// The names and addresses under which its holder may listen.
    pub addresses: Vec<String>,
    /// The robots that it lists.
    pub robots: Vec<String>,
    /// Whether the given authority has signed it.
    pub(crate) is_signed: bool,
}

impl Certificate {
    /// Reads the first certificate of a PEM file, and whether the one in `authority` has signed it.
    pub(crate) fn read(pem: &[u8], authority: &[u8]) -> Result<Self, String> {
        let (_, pem) = parse_x509_pem(pem).map_err(|error| error.to_string())?;
        let (_, authority) = parse_x509_pem(authority).map_err(|error| error.to_string())?;
        let (_, authority) =
            X509Certificate::from_der(&authority.contents).map_err(|error| error.to_string())?;
        let (_, certificate) = X509Certificate::from_der(&pem.contents).map_err(|error| error.to_string())?;
        let common_name = certificate.subject().iter_common_name().find_map(|name| name.as_str().ok());
        let alternatives = certificate.subject_alternative_name().ok().flatten();
        let alternatives = alternatives.map_or(&[][..], |names| &names.value.general_names);
        Ok(Self {
            common_name: common_name.unwrap_or_default().to_owned(),
            not_before: certificate.validity().not_before.timestamp(),
            not_after: certificate.validity().not_after.timestamp(),
            addresses: alternatives.iter().filter_map(address).collect(),
            robots: alternatives.iter().filter_map(robot).collect(),
            is_signed: certificate.verify_signature(Some(authority.public_key())).is_ok(),
        })
    }

    /// Whether less than a third of its time is left.
    pub fn is_due(&self) -> bool {
        let issued = self.not_before + CLOCKS_DIFFER.as_secs() as i64;
        let whole = self.not_after - issued;
        let left = self.not_after - now();
        left * 3 < whole
    }

    /// Until when it is valid, as a person reads it.
    pub fn until(&self) -> String {
        date(self.not_after)
    }
}

fn address(name: &GeneralName<'_>) -> Option<String> {
    match name {
        GeneralName::DNSName(name) => Some((*name).to_owned()),
        GeneralName::IPAddress(bytes) => match bytes.len() {
            4 => Some(IpAddr::from(<[u8; 4]>::try_from(*bytes).ok()?).to_string()),
            _ => Some(IpAddr::from(<[u8; 16]>::try_from(*bytes).ok()?).to_string()),
        },
        _ => None,
    }
}

fn robot(name: &GeneralName<'_>) -> Option<String> {
    let GeneralName::URI(uri) = name else { return None };
    uri.strip_prefix(LISTED).map(str::to_owned)
}

/// Seconds since 1970.
pub(crate) fn now() -> i64 {
    OffsetDateTime::now_utc().unix_timestamp()
}

/// A date and time in UTC.
pub(crate) fn date(seconds: i64) -> String {
    OffsetDateTime::from_unix_timestamp(seconds).map_or_else(
        |_| seconds.to_string(),
        |t| {
            let (year, month, day) = t.to_calendar_date();
            format!(
                "{year}-{:02}-{day:02} {:02}:{:02}:{:02} UTC",
                u8::from(month),
                t.hour(),
                t.minute(),
                t.second()
            )
        },
    )
}

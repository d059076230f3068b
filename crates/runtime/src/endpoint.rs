//! Endpoints and namespaces as people write them, checked before Zenoh sees them: it would look for a router for ever,
//! or complain in its own terms.

use std::net::{Ipv4Addr, Ipv6Addr};

use curionav_planning::parameters::FieldError;

/// The protocols of links that this build has.
pub const LINKS: [&str; 3] = ["tcp", "tls", "unixsock-stream"];
/// Of protocols with an address of the network.
const PORT: &str = "7447";
const HOST: &str = "127.0.0.1";
const SOCKET: &str = "unixsock-stream//run/curionav/robot.sock";

/// What an endpoint is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A router is there.
    Connect,
    /// A router shall be there; port 0 takes a free one.
    Listen,
}

/// Why a text is not what it should be, and what to write instead.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is no {what}: {problem}; {mend}")]
pub struct AddressError {
    text: String,
    what: &'static str,
    problem: String,
    mend: String,
}

impl AddressError {
    /// As a fault of the field of this name.
    pub fn at(self, field: &str) -> FieldError {
        FieldError::new(field, format!("`{}` is no {}: {}", self.text, self.what, self.problem), self.mend)
    }
}

/// Whether `endpoint` is `tcp/HOST:PORT`, `tls/HOST:PORT` or `unixsock-stream/PATH`.
///
/// # Errors
/// What is wrong with it, and the right form.
pub fn check_endpoint(endpoint: &str, purpose: Purpose) -> Result<(), AddressError> {
    // What Zenoh takes behind the address is its own business.
    let address = endpoint.split(['?', '#']).next().unwrap_or_default();
    parse(address, purpose).map_err(|(problem, right)| AddressError {
        text: endpoint.into(),
        what: "endpoint",
        problem,
        mend: format!("give {right}"),
    })
}

/// What is wrong, and the right form.
type Fault = (String, String);

fn parse(text: &str, purpose: Purpose) -> Result<(), Fault> {
    if text.is_empty() {
        return Err(("it is empty".into(), right_form("tcp", "")));
    }
    if text.chars().any(|c| c.is_whitespace() || c.is_control()) {
        let plain: String = text.chars().filter(|c| !c.is_whitespace() && !c.is_control()).collect();
        return Err(("it has blanks".into(), plain));
    }
    if let Some((scheme, rest)) = text.split_once("://") {
        return Err(("it is a URL".into(), right_form(scheme, rest)));
    }
    let Some((protocol, address)) = text.split_once('/').filter(|(protocol, _)| is_word(protocol)) else {
        return Err(("it names no protocol".into(), right_form("tcp", text)));
    };
    if !LINKS.contains(&protocol) {
        let [first, second, third] = LINKS;
        let problem = format!("`{protocol}` is none of the protocols {first}, {second} and {third}");
        return Err((problem, right_form(&protocol.to_lowercase(), address)));
    }
    if protocol == "unixsock-stream" {
        let has_path = !address.is_empty();
        return has_path.then_some(()).ok_or_else(|| ("it has no path".into(), SOCKET.into()));
    }
    check_address(address, purpose).map_err(|problem| (problem, right_form(protocol, address)))
}

/// Whether this could be meant as the name of a protocol rather than as a host.
fn is_word(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphabetic() || matches!(c, '-' | '_'))
}

fn check_address(address: &str, purpose: Purpose) -> Result<(), String> {
    let (host, port) = split(address);
    if host.is_empty() {
        return Err("it has no host".into());
    }
    if host.contains(':') && !host.starts_with('[') {
        return Err("an IPv6 address stands in brackets".into());
    }
    if !is_host(host) {
        return Err(format!("`{host}` is no host name and no address"));
    }
    let Some(port) = port.filter(|port| !port.is_empty()) else {
        return Err("it has no port".into());
    };
    let least = if purpose == Purpose::Listen { 0 } else { 1 };
    match number(port) {
        Some(number) if number >= least => Ok(()),
        _ => Err(format!("its port `{port}` is no number from {least} to 65535")),
    }
}

/// Host and port, either of which may be wrong.
fn split(address: &str) -> (&str, Option<&str>) {
    if let Some(end) = address.starts_with('[').then(|| address.find(']')).flatten() {
        let (host, rest) = address.split_at(end + 1);
        return (host, rest.strip_prefix(':'));
    }
    match address.parse::<Ipv6Addr>() {
        // Its last part may be meant as a port, if there is enough before it.
        Ok(_) => match address.rsplit_once(':') {
            Some((host, port)) if host.parse::<Ipv6Addr>().is_ok() => (host, Some(port)),
            _ => (address, None),
        },
        Err(_) => address
            .split_once(':')
            .filter(|(host, _)| !host.is_empty() || !address.starts_with("::"))
            .map_or((address, None), |(host, port)| (host, Some(port))),
    }
}

fn number(port: &str) -> Option<u16> {
    port.bytes().all(|b| b.is_ascii_digit()).then(|| port.parse().ok()).flatten()
}

/// Whether a router's certificate can be for `host`: a name or an address, without brackets.
///
/// # Errors
/// What is wrong with it, and the right form.
pub fn check_certified_host(host: &str) -> Result<(), AddressError> {
    if host.parse::<Ipv6Addr>().is_ok() || !host.starts_with('[') && is_host(host) {
        return Ok(());
    }
    let after_scheme = host.rsplit_once('/').map_or(host, |(_, rest)| rest);
    let bare = split(after_scheme).0.trim_matches(['[', ']']);
    let is_right = bare.parse::<Ipv6Addr>().is_ok() || is_host(bare);
    Err(AddressError {
        text: host.into(),
        what: "host of a router",
        problem: "it is a name or an address by which clients connect, without protocol, port or `*`".into(),
        mend: if is_right { format!("give {bare}") } else { "give such as 10.0.0.1 or hall.example".into() },
    })
}

/// Whether this is an address, with IPv6 in brackets, or can be the name of a host.
pub fn is_host(host: &str) -> bool {
    if let Some(inside) = host.strip_prefix('[') {
        return inside.strip_suffix(']').is_some_and(|inside| inside.parse::<Ipv6Addr>().is_ok());
    }
    let is_number = host.chars().all(|c| c.is_ascii_digit() || c == '.');
    let is_name = host.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_'));
    if is_number { host.parse::<Ipv4Addr>().is_ok() } else { is_name && !host.starts_with(['.', '-']) }
}

/// What was probably meant, with a port and a host where they are missing or wrong.
fn right_form(protocol: &str, address: &str) -> String {
    let protocol = if LINKS.contains(&protocol) { protocol } else { "tcp" };
    let (host, port) = split(address.trim_end_matches('/'));
    let bracketed = format!("[{host}]");
    let host = match host {
        host if is_host(host) => host,
        _ if is_host(&bracketed) => &bracketed,
        _ => HOST,
    };
    let port = port.filter(|port| number(port).is_some_and(|number| number > 0)).unwrap_or(PORT);
    format!("{protocol}/{host}:{port}")
}

/// Whether this cannot stand in a name of a key.
fn is_special(c: char) -> bool {
    c.is_whitespace() || c.is_control() || "*$?#".contains(c)
}

/// Whether `namespace` can be the prefix of keys: names with a slash between them.
///
/// # Errors
/// What is wrong with it, and the right form.
pub fn check_namespace(namespace: &str) -> Result<(), AddressError> {
    let plain = namespace.split('/').map(|name| name.replace(is_special, ""));
    let names: Vec<String> = plain.filter(|name| !name.is_empty()).collect();
    let right = names.join("/");
    if right == namespace && !right.is_empty() {
        return Ok(());
    }
    Err(AddressError {
        text: namespace.into(),
        what: "namespace",
        problem: "it is made of names, without blanks and *, $, ? and #, and with one slash between two"
            .into(),
        mend: if right.is_empty() { "leave it out".into() } else { format!("give {right}") },
    })
}

#[cfg(test)]
mod tests {
    use toml::{Table, Value};

    use super::*;

    /// What the Python package is held to as well.
    const TABLE: &str = include_str!("../../../python/tests/data/endpoints.toml");

    fn texts(table: &Table, key: &str) -> Vec<String> {
        table[key].clone().try_into().unwrap()
    }

    /// Each text that is refused, with what is said of it.
    fn refused(table: &Table) -> Vec<(String, String)> {
        let rows: Vec<Table> = table["refused"].clone().try_into().unwrap();
        let text = |row: &Table, key: &str| row[key].as_str().unwrap().to_owned();
        rows.iter().map(|row| (text(row, "text"), text(row, "says"))).collect()
    }

    #[test]
    fn endpoints_are_taken_or_refused_with_the_right_form() {
        let table: Table = TABLE.parse().unwrap();
        for text in texts(&table, "connect") {
            check_endpoint(&text, Purpose::Connect).unwrap();
            check_endpoint(&text, Purpose::Listen).unwrap();
        }
        for (text, says) in refused(&table) {
            let error = check_endpoint(&text, Purpose::Connect).unwrap_err().to_string();
            assert!(error.contains(&says), "`{says}` is not in: {error}");
        }
        check_endpoint("tcp/127.0.0.1:0", Purpose::Listen).unwrap();
    }

    #[test]
    fn what_is_to_be_given_instead_is_taken() {
        let table: Table = TABLE.parse().unwrap();
        for (text, _) in refused(&table) {
            let error = check_endpoint(&text, Purpose::Connect).unwrap_err();
            let right = error.mend.strip_prefix("give ").unwrap();
            check_endpoint(right, Purpose::Connect).unwrap_or_else(|e| panic!("{text}: {e}"));
        }
    }

    #[test]
    fn a_certificate_is_for_hosts() {
        for host in ["10.0.0.1", "::1", "fe80::1", "router.hall.example", "localhost"] {
            check_certified_host(host).unwrap();
        }
        for (host, mend) in [
            ("10.0.0.1:7447", "give 10.0.0.1"),
            ("tls/10.0.0.1:7447", "give 10.0.0.1"),
            ("tls://router.example", "give router.example"),
            ("[::1]:7447", "give ::1"),
            ("[::1]", "give ::1"),
            ("*", "give such as 10.0.0.1 or hall.example"),
            ("*.hall.example", "give such as 10.0.0.1 or hall.example"),
            ("10.0.0.256", "give such as 10.0.0.1 or hall.example"),
            ("", "give such as 10.0.0.1 or hall.example"),
        ] {
            let error = check_certified_host(host).unwrap_err().to_string();
            assert!(error.ends_with(mend), "{host}: {error}");
        }
    }

    #[test]
    fn namespaces_are_taken_or_refused_with_the_right_form() {
        let table: Table = TABLE.parse().unwrap();
        let Value::Table(namespaces) = &table["namespaces"] else { panic!("no table") };
        for text in texts(namespaces, "allowed") {
            check_namespace(&text).unwrap();
        }
        for (text, says) in refused(namespaces) {
            let error = check_namespace(&text).unwrap_err().to_string();
            assert!(error.ends_with(&says), "`{says}` is not at the end of: {error}");
        }
    }
}

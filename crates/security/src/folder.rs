//! A folder of certificates: the authority, one certificate and key per name, and the router's rules.
//!
//! | file | who needs it |
//! |---|---|
//! | `ca.pem` | every machine |
//! | `ca.key` | only where certificates are issued |
//! | `NAME.pem`, `NAME.key` | the machine of that program; `ls` of `*.pem` is what rules are made for |
//! | `rules.json` | routers |

use std::fs;
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use curionav_schemas::keys::check_id;
use serde::{Deserialize, Serialize};

pub use crate::certificate::Certificate;
use crate::certificate::{Made, authority, date, now, signed};
pub use crate::folder_error::FolderError;
use crate::name::Name;
use crate::rules::Rules;

/// How long a certificate is valid unless told otherwise, days. There is no list of revoked ones: a lost key is of use
/// for no longer than this.
pub const LIFETIME_DAYS: u32 = 30;
/// How long the authority is valid, days.
pub const AUTHORITY_DAYS: u32 = 3650;
/// Where routers may be reached unless told otherwise.
pub const ADDRESSES: [&str; 3] = ["localhost", "127.0.0.1", "::1"];

const CA: &str = "ca";
const RULES: &str = "rules.json";

/// The rules and what they were made for.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RulesFile {
    namespace: Option<String>,
    access_control: Rules,
}

/// What a program shows to a router, or a router to its clients.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Whose it is.
    pub name: Name,
    /// The authority's certificate.
    pub authority: PathBuf,
    /// Its own.
    pub certificate: PathBuf,
    /// The key.
    pub key: PathBuf,
    /// Until when the certificate is valid.
    pub until: String,
}

/// A folder of certificates.
#[derive(Debug, Clone)]
pub struct Folder {
    directory: PathBuf,
    /// Where a program's own keys are, if they are not beside the certificates.
    keys: Option<PathBuf>,
}

impl Folder {
    /// The folder, whether it is there or not.
    pub fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), keys: None }
    }

    /// The same, with keys in a folder of their own, such as the one in which systemd hands a service its key. Keys are
    /// never renewed, so a copy of a key stays good; a copy of a certificate does not. What is not in `keys` is looked
    /// for beside the certificates.
    #[must_use]
    pub fn with_keys(self, keys: Option<PathBuf>) -> Self {
        Self { keys, ..self }
    }

    fn key(&self, stem: &str) -> PathBuf {
        let handed = self.keys.iter().map(|keys| keys.join(format!("{stem}.key"))).find(|key| key.exists());
        handed.unwrap_or_else(|| self.path(stem, "key"))
    }

    fn path(&self, stem: &str, extension: &str) -> PathBuf {
        self.directory.join(format!("{stem}.{extension}"))
    }

    fn shown(&self, stem: &str, extension: &str) -> String {
        self.path(stem, extension).display().to_string()
    }

    fn command(&self, what: &str) -> String {
        let (verb, rest) = what.split_once(' ').unwrap_or((what, ""));
        format!("curionav secure {verb} {} {rest}", self.directory.display()).trim_end().to_owned()
    }

    /// Whether it has an authority.
    pub fn is_initialised(&self) -> bool {
        self.path(CA, "pem").exists()
    }

    /// Makes an authority, and rules that allow nothing yet.
    pub fn init(&self, namespace: Option<&str>) -> Result<(), FolderError> {
        if self.is_initialised() {
            let mend = "issue certificates with it, or choose another folder".into();
            return Err(FolderError::Exists { path: self.shown(CA, "pem"), mend });
        }
        if let Some(namespace) = namespace {
            let checked = namespace.split('/').try_for_each(check_id);
            checked.map_err(|error| self.malformed("namespace", error.to_string(), "give another"))?;
        }
        let made = authority(days(AUTHORITY_DAYS));
        let made = made.map_err(|reason| self.malformed("ca.pem", reason, "try again"))?;
        self.write("ca.key", made.key.as_bytes(), 0o600)?;
        self.write("ca.pem", made.certificate.as_bytes(), 0o644)?;
        self.write_rules(namespace.map(str::to_owned))
    }

    /// Issues a certificate with a key of its own. A router's holds `addresses` as well.
    pub fn issue(&self, name: &Name, addresses: &[String], lifetime: Duration) -> Result<(), FolderError> {
        let stem = name.to_string();
        if self.path(&stem, "pem").exists() {
            let mend = format!("{}, or delete it for a new key", self.command(&format!("renew {name}")));
            return Err(FolderError::Exists { path: self.shown(&stem, "pem"), mend });
        }
        let addresses: Vec<String> = match name.is_router() {
            true => ADDRESSES.iter().map(|&a| a.to_owned()).chain(addresses.iter().cloned()).collect(),
            false => Vec::new(),
        };
        self.sign(name, &addresses, lifetime, None)?;
        self.write_rules(self.namespace()?)
    }

    /// Issues a certificate anew, with the same key, addresses and robots: programs take it at their next connection.
    pub fn renew(&self, name: &Name, lifetime: Duration) -> Result<(), FolderError> {
        self.renew_with(&self.listed(name)?, lifetime)
    }

    /// Issues a certificate anew, with the same key and addresses, for the robots that `name` lists, and writes the
    /// rules for them.
    pub fn renew_for(&self, name: &Name, lifetime: Duration) -> Result<(), FolderError> {
        self.renew_with(name, lifetime)?;
        self.write_rules(self.namespace()?)
    }

    fn renew_with(&self, name: &Name, lifetime: Duration) -> Result<(), FolderError> {
        let stem = name.to_string();
        let old = self.read(&stem)?;
        let key = self.text(&stem, "key", &self.command(&format!("issue {name}")))?;
        self.sign(name, &old.addresses, lifetime, Some(&key))
    }

    /// The name, with the robots that its certificate lists.
    pub fn listed(&self, name: &Name) -> Result<Name, FolderError> {
        let robots = self.read(&name.to_string())?.robots;
        if robots.is_empty() { Ok(name.clone()) } else { Ok(name.clone().for_robots(&robots)?) }
    }

    /// Issues the certificate of `name` if there is none, and renews it if it is due.
    pub fn keep_valid(&self, name: &Name, lifetime: Duration) -> Result<(), FolderError> {
        if !self.path(&name.to_string(), "pem").exists() {
            return self.issue(name, &[], lifetime);
        }
        self.renew_if_due(name, lifetime).map(drop)
    }

    /// Renews the certificate of `name` if it is there and due; whether it was.
    pub fn renew_if_due(&self, name: &Name, lifetime: Duration) -> Result<bool, FolderError> {
        let stem = name.to_string();
        let is_due = self.path(&stem, "pem").exists() && self.read(&stem)?.is_due();
        if is_due {
            self.renew(name, lifetime)?;
        }
        Ok(is_due)
    }

    fn sign(
        &self,
        name: &Name,
        addresses: &[String],
        lifetime: Duration,
        key: Option<&str>,
    ) -> Result<(), FolderError> {
        let mend = "certificates are issued where the authority's key is";
        let authority = Made {
            certificate: self.text(CA, "pem", &self.command("init"))?,
            key: self.text(CA, "key", mend)?,
        };
        let made = signed(&authority, name, addresses, lifetime, key);
        let made = made.map_err(|reason| {
            self.malformed(&format!("{name}.pem"), reason, "look at the addresses, and at ca.pem and ca.key")
        })?;
        if key.is_none() {
            self.write(&format!("{name}.key"), made.key.as_bytes(), 0o600)?;
        }
        self.write(&format!("{name}.pem"), made.certificate.as_bytes(), 0o644)
    }

    /// Every certificate, by name.
    pub fn certificates(&self) -> Result<Vec<(Name, Certificate)>, FolderError> {
        let mut found = Vec::new();
        let fault = |error: std::io::Error| self.file(&self.directory, &error);
        for entry in fs::read_dir(&self.directory).map_err(fault)? {
            let file = entry.map_err(fault)?.file_name();
            let Some(stem) = file.to_str().and_then(|file| file.strip_suffix(".pem")) else { continue };
            if stem != CA {
                found.push((self.listed(&stem.parse()?)?, self.read(stem)?));
            }
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(found)
    }

    /// What the certificate of a name says, valid or not.
    pub fn read(&self, stem: &str) -> Result<Certificate, FolderError> {
        let authority = self.text(CA, "pem", "copy it from where certificates are issued")?;
        let mend = format!("where the authority's key is: {}", self.command(&format!("issue {stem}")));
        let pem = self.text(stem, "pem", &mend)?;
        Certificate::read(pem.as_bytes(), authority.as_bytes()).map_err(|reason| {
            self.malformed(&format!("{stem}.pem"), reason, "copy it again, or delete it and issue another")
        })
    }

    /// The first of these names that has a certificate here, with the robots that this lists.
    pub fn first_of(&self, names: &[Name]) -> Option<Name> {
        let found = names.iter().find(|name| self.path(&name.to_string(), "pem").exists())?;
        Some(self.listed(found).unwrap_or_else(|_| found.clone()))
    }

    /// The names with certificates here that begin with `role` and list robots.
    pub fn that_list_robots(&self, role: &str) -> Vec<Name> {
        let Ok(entries) = fs::read_dir(&self.directory) else { return Vec::new() };
        let files = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let stems = files.filter_map(|file| Some(file.strip_suffix(".pem")?.to_owned()));
        let names = stems.filter_map(|stem| stem.parse::<Name>().ok());
        let listed = names.filter(|name| name.role() == role).filter_map(|name| self.listed(&name).ok());
        let mut found: Vec<Name> = listed.filter(|name| !name.robots().is_empty()).collect();
        found.sort();
        found
    }

    /// What the holder of `name` shows. It is valid now, and of this folder's authority.
    pub fn identity(&self, name: &Name) -> Result<Identity, FolderError> {
        let stem = name.to_string();
        let certificate = self.read(&stem)?;
        let path = self.shown(&stem, "pem");
        let name_in_it = certificate.common_name.clone();
        let renew = self.command(&format!("renew {name}"));
        if !certificate.is_signed {
            let authority = self.shown(CA, "pem");
            let mend = format!("copy both again, or {renew}");
            return Err(FolderError::Foreign { path, name: name_in_it, authority, mend });
        }
        if name_in_it != stem {
            let reason = format!("is the certificate of `{name_in_it}`");
            return Err(self.malformed(&format!("{stem}.pem"), reason, "give the file that name"));
        }
        let when = match now() {
            now if now >= certificate.not_after => Some(format!("has expired on {}", certificate.until())),
            now if now < certificate.not_before => {
                Some(format!("is valid only from {} on", date(certificate.not_before)))
            }
            _ => None,
        };
        if let Some(when) = when {
            let mend = format!("renew it where the authority's key is: {renew}");
            return Err(FolderError::Expired { path, name: name_in_it, when, mend });
        }
        let key = self.key(&stem);
        self.read_text(&key, "copy it from where it was issued")?;
        Ok(Identity {
            name: name.clone(),
            authority: self.path(CA, "pem"),
            certificate: self.path(&stem, "pem"),
            key,
            until: certificate.until(),
        })
    }

    /// The router's access rules.
    pub fn rules(&self) -> Result<Rules, FolderError> {
        Ok(self.rules_file()?.access_control)
    }

    /// Writes the rules anew for the certificates that are here: after one was deleted, or for another namespace.
    pub fn renew_rules(&self, namespace: Option<&str>) -> Result<(), FolderError> {
        self.write_rules(namespace.map(str::to_owned))
    }

    /// The namespace that the rules are for.
    pub fn namespace(&self) -> Result<Option<String>, FolderError> {
        Ok(self.rules_file()?.namespace)
    }

    fn rules_file(&self) -> Result<RulesFile, FolderError> {
        let text = match fs::read_to_string(self.directory.join(RULES)) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let path = self.directory.join(RULES).display().to_string();
                let mend =
                    format!("copy it from where certificates are issued, or {}", self.command("rules"));
                return Err(FolderError::Missing { path, mend });
            }
            read => read.map_err(|error| self.file(&self.directory.join(RULES), &error))?,
        };
        serde_json::from_str(&text).map_err(|error| {
            self.malformed(RULES, error.to_string(), "write it anew with curionav secure rules")
        })
    }

    /// Writes the rules for every certificate in the folder.
    fn write_rules(&self, namespace: Option<String>) -> Result<(), FolderError> {
        let certificates = self.certificates()?;
        let names = certificates.iter().map(|(name, _)| name);
        let access_control = Rules::new(names, namespace.as_deref());
        let text = serde_json::to_string_pretty(&RulesFile { namespace, access_control });
        let text = text.map_err(|error| self.malformed(RULES, error.to_string(), "try again"))?;
        self.write(RULES, text.as_bytes(), 0o644)
    }

    fn text(&self, stem: &str, extension: &str, mend: &str) -> Result<String, FolderError> {
        self.read_text(&self.path(stem, extension), mend)
    }

    fn read_text(&self, path: &Path, mend: &str) -> Result<String, FolderError> {
        match fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                Err(FolderError::Missing { path: path.display().to_string(), mend: mend.into() })
            }
            read => read.map_err(|error| self.file(path, &error)),
        }
    }

    /// Writes a file whole or not at all: another process may read it at any moment.
    fn write(&self, file: &str, bytes: &[u8], mode: u32) -> Result<(), FolderError> {
        let path = self.directory.join(file);
        let new = self.directory.join(format!(".{file}.new"));
        let written =
            fs::DirBuilder::new().recursive(true).mode(0o700).create(&self.directory).and_then(|()| {
                let _ = fs::remove_file(&new);
                let mut open = fs::OpenOptions::new().write(true).create_new(true).mode(mode).open(&new)?;
                open.write_all(bytes)?;
                open.sync_all()?;
                fs::rename(&new, &path)
            });
        written.map_err(|error| self.file(&path, &error))
    }

    fn file(&self, path: &Path, error: &std::io::Error) -> FolderError {
        FolderError::File { path: path.display().to_string(), reason: error.to_string() }
    }

    fn malformed(&self, file: &str, reason: String, mend: &str) -> FolderError {
        FolderError::Malformed {
            path: self.directory.join(file).display().to_string(),
            reason,
            mend: mend.into(),
        }
    }
}

/// So many days.
pub fn days(count: u32) -> Duration {
    Duration::from_secs(u64::from(count) * 86_400)
}

//! `curionav secure`: certificates, and who may do what.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;
use comfy_table::Table;
use curionav_runtime::endpoint::check_certified_host;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;
use curionav_security::folder::{AUTHORITY_DAYS, Folder, FolderError, LIFETIME_DAYS, days};
use curionav_security::name::Name;
use curionav_security::page;
use curionav_security::table::Verb;

/// Make, renew and show certificates for a deployment over TLS.
///
/// A folder holds an authority, a certificate with a key for each program and person, and the rules that let each
/// do no more than its name allows. `curionav up DEPLOYMENT.toml --secure DIR` makes such a folder by itself; these
/// commands are for several machines.
///
///   curionav secure init pki
///   curionav secure issue pki router --address 10.0.0.1
///   curionav secure issue pki driver.r1 localizer.r1 arbiter.r1 cpc.a cnc.a generator.a operator
///   curionav secure issue pki operator.ward3 --robots r1,r2
///   curionav secure show pki
///
/// Then every machine gets `ca.pem` and the `NAME.pem` and `NAME.key` of what runs on it, routers get `rules.json` as
/// well, and every command takes `--secure DIR`. See docs/security.md.
#[derive(Debug, Subcommand)]
#[command(verbatim_doc_comment)]
pub(crate) enum SecureCommand {
    /// Make a folder with an authority.
    Init {
        /// Folder of the certificates.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Key prefix of the deployment: rules hold for it alone.
        #[arg(long, value_name = "NS")]
        namespace: Option<String>,
    },
    /// Issue certificates, each with its own key, and write the access rules for them. Routers read the rules when
    /// they start.
    Issue {
        /// Folder of the certificates.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Names, such as driver.r1, cpc.a, viewer or router; see `curionav secure rights`.
        #[arg(value_name = "NAME", required = true)]
        names: Vec<Name>,
        /// Host name or address of a router, beside those of this machine (localhost, 127.0.0.1, ::1); may be given
        /// several times.
        #[arg(long, value_name = "HOST")]
        address: Vec<String>,
        /// Robots that operator.NAME or viewer.NAME may see or command, such as r1,r2; `*` for all. Default: the robot
        /// NAME alone.
        #[arg(long, value_name = "ROBOT", value_delimiter = ',')]
        robots: Vec<String>,
        /// Days for which they are valid.
        #[arg(long, value_name = "N", default_value_t = LIFETIME_DAYS,
            value_parser = clap::value_parser!(u32).range(1..=i64::from(AUTHORITY_DAYS)))]
        days: u32,
    },
    /// Renew certificates and keep their keys. Programs read them at their next connection, routers when they
    /// start.
    Renew {
        /// Folder of the certificates.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Names. Default: all in the folder.
        #[arg(value_name = "NAME")]
        names: Vec<Name>,
        /// Robots that operator.NAME or viewer.NAME may see or command from now on, such as r1,r2; also writes the
        /// rules again. Default: those of before.
        #[arg(long, value_name = "ROBOT", value_delimiter = ',', requires = "names")]
        robots: Vec<String>,
        /// Days for which they are valid.
        #[arg(long, value_name = "N", default_value_t = LIFETIME_DAYS,
            value_parser = clap::value_parser!(u32).range(1..=i64::from(AUTHORITY_DAYS)))]
        days: u32,
    },
    /// Show the certificates: how long each is valid, and what it allows.
    Show {
        /// Folder of the certificates.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Name of one certificate; show also every key that it allows.
        #[arg(value_name = "NAME")]
        name: Option<Name>,
    },
    /// Write the rules again for the certificates in the folder. Do this after you delete a certificate whose key was
    /// lost, or to change the namespace.
    Rules {
        /// Folder of the certificates.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Key prefix of the deployment.
        #[arg(long, value_name = "NS")]
        namespace: Option<String>,
    },
    /// Print who may do what, as in docs/security.md.
    Rights,
}

pub(crate) fn run(command: SecureCommand) -> Result<u8, Exit> {
    match command {
        SecureCommand::Init { folder, namespace } => {
            Folder::new(&folder).init(namespace.as_deref()).map_err(Exit::bad_input)?;
            print(format_args!(
                "{}: an authority, valid for {AUTHORITY_DAYS} days; keep ca.key to yourself",
                folder.display()
            ))?;
        }
        SecureCommand::Issue { folder, names, address, robots, days: count } => {
            for host in &address {
                check_certified_host(host).context("address").map_err(Exit::bad_input)?;
            }
            for name in &for_robots(names, &robots)? {
                Folder::new(&folder).issue(name, &address, days(count)).map_err(Exit::bad_input)?;
                say(&folder, name, "issued")?;
            }
            print("routers read rules.json when they start: copy it to them and restart them")?;
        }
        SecureCommand::Renew { folder, names, robots, days: count } if !robots.is_empty() => {
            for name in &for_robots(names, &robots)? {
                Folder::new(&folder).renew_for(name, days(count)).map_err(Exit::bad_input)?;
                say(&folder, name, "renewed")?;
            }
            print("routers read rules.json when they start: copy it to them and restart them")?;
        }
        SecureCommand::Renew { folder, names, days: count, .. } => {
            let here = Folder::new(&folder);
            let names = match names.is_empty() {
                true => {
                    here.certificates().map_err(Exit::bad_input)?.into_iter().map(|(name, _)| name).collect()
                }
                false => names,
            };
            for name in &names {
                here.renew(name, days(count)).map_err(Exit::bad_input)?;
                say(&folder, name, "renewed")?;
            }
        }
        SecureCommand::Show { folder, name } => {
            print(table(&folder).map_err(Exit::bad_input)?)?;
            if let Some(name) = name {
                // A name without a certificate has the rights that it would have.
                print(rights(&Folder::new(&folder).first_of(std::slice::from_ref(&name)).unwrap_or(name)))?;
            }
        }
        SecureCommand::Rules { folder, namespace } => {
            Folder::new(&folder).renew_rules(namespace.as_deref()).map_err(Exit::bad_input)?;
            print(format_args!(
                "{}: rules.json is written; restart the routers that read it",
                folder.display()
            ))?;
        }
        SecureCommand::Rights => print(page::rights().trim_end())?,
    }
    Ok(SUCCESS)
}

/// These names for these robots, if any are given.
fn for_robots(names: Vec<Name>, robots: &[String]) -> Result<Vec<Name>, Exit> {
    if robots.is_empty() {
        return Ok(names);
    }
    let listed: Result<_, _> = names.into_iter().map(|name| name.for_robots(robots)).collect();
    listed.map_err(Exit::bad_input)
}

fn say(folder: &Path, name: &Name, done: &str) -> Result<(), Exit> {
    let until = Folder::new(folder).read(&name.to_string()).map_err(Exit::bad_input)?.until();
    let file = folder.join(name.to_string()).display().to_string();
    print(format_args!("{file}.pem: {done}, valid until {until}; {}", name.row().about))
}

/// Every certificate: until when, in what state, and what for.
fn table(folder: &Path) -> Result<Table, FolderError> {
    let here = Folder::new(folder);
    let mut table = Table::new();
    table.set_header(["certificate", "valid until", "state", "robots", "may", "is for"]);
    for (name, certificate) in here.certificates()? {
        let state = match here.identity(&name) {
            Ok(_) if certificate.is_due() => "due for renewal".to_owned(),
            Ok(_) => "valid".to_owned(),
            Err(FolderError::Missing { .. }) => "without key here".to_owned(),
            Err(FolderError::Expired { .. }) => "NOT VALID NOW".to_owned(),
            Err(FolderError::Foreign { .. }) => "OF ANOTHER AUTHORITY".to_owned(),
            Err(error) => error.to_string(),
        };
        let may: Vec<&str> =
            Verb::ALL.iter().filter(|verb| name.has(**verb)).map(|verb| verb.word()).collect();
        table.add_row([
            name.to_string(),
            certificate.until(),
            state,
            name.robots().join(", "),
            may.join(", "),
            name.row().about.into(),
        ]);
    }
    Ok(table)
}

/// What one name allows, a line for each verb.
fn rights(name: &Name) -> String {
    let mut lines = Vec::new();
    for verb in Verb::ALL {
        let rights = name.rights().filter(|right| right.verb == *verb);
        let keys: Vec<String> = rights.flat_map(|right| right.keys).flat_map(|key| name.fill(key)).collect();
        if !keys.is_empty() {
            lines.push(format!("{name} may {}: {}", verb.word(), keys.join(", ")));
        }
    }
    lines.join("\n")
}

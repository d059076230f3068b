//! Who may do what. [`table`] is the one list of rights. The router's access rules ([`rules`]), the page in
//! `docs/security.md` ([`page`]) and the answer to whether something is allowed ([`permission`]) are made of it.
//! [`folder`] makes and reads the certificates whose names ([`name`]) the rules are about.

mod certificate;
pub mod folder;
mod folder_error;
pub mod name;
pub mod page;
pub mod permission;
mod right;
pub mod rules;
pub mod table;

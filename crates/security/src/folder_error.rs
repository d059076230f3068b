//! What can be wrong with a folder of certificates.

use crate::name::NameError;

/// What is wrong with a folder, and what mends it.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file that is needed is not there.
    #[error("{path}: is missing; {mend}")]
    Missing {
        /// The file.
        path: String,
        /// How to get it.
        mend: String,
    },
    /// A file that must not be there is.
    #[error("{path}: is there already; {mend}")]
    Exists {
        /// The file.
        path: String,
        /// What to do instead.
        mend: String,
    },
    /// A certificate's time is over, or has not come.
    #[error("{path}: the certificate `{name}` {when}; {mend}")]
    Expired {
        /// The file.
        path: String,
        /// Its common name.
        name: String,
        /// Since or until when.
        when: String,
        /// How to get a valid one.
        mend: String,
    },
    /// A certificate of another authority.
    #[error("{path}: the certificate `{name}` is not signed by the authority in {authority}; {mend}")]
    Foreign {
        /// The file.
        path: String,
        /// Its common name.
        name: String,
        /// The authority's file.
        authority: String,
        /// What to do.
        mend: String,
    },
    /// A file that cannot be understood.
    #[error("{path}: {reason}; {mend}")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
        /// What to do.
        mend: String,
    },
    /// No name of a certificate.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A file cannot be read or written.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
}

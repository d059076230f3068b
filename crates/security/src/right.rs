//! What a right is: something that may be done with keys.

use strum::{IntoStaticStr, VariantArray};

/// The part of a row whose name is that of a robot, or of a group of robots that the certificate lists.
pub const ROBOTS: &str = "robots";

/// Something that a program may do with keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Verb {
    /// Publish.
    Put,
    /// Receive what is published.
    Subscribe,
    /// See whether there are subscribers: what is made only while something listens.
    Notice,
    /// Ask and be answered.
    Ask,
    /// Be asked and answer.
    Serve,
    /// See who serves: routers pass questions on only to where they are answered.
    Find,
    /// Hold a liveliness token.
    Hold,
    /// See liveliness tokens.
    Watch,
}

impl Verb {
    /// All of them.
    pub const ALL: &[Self] = Self::VARIANTS;

    /// The word in the page.
    pub fn word(self) -> &'static str {
        self.into()
    }
}

/// Where the keys of a right lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// Under the namespace of the deployment, if it has one.
    Deployment,
    /// Without a namespace: routers know none.
    Router,
}

/// One verb and the keys it is for.
#[derive(Debug, Clone, Copy)]
pub struct Right {
    /// What may be done.
    pub verb: Verb,
    /// With which keys.
    pub keys: &'static [&'static str],
    /// Where they lie.
    pub space: Space,
}

/// What one kind of program may do.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The first part of the certificate's name. `{term}` stands for any other word: the term of an evaluator.
    /// `own-{planner}` stands for any word that begins with `own-`.
    pub role: &'static str,
    /// The parts that follow.
    pub names: &'static [&'static str],
    /// What it is for.
    pub about: &'static str,
    /// Its rights.
    pub rights: &'static [Right],
    /// Whether it is a service: it then also holds `live/{role}/{instance}` and serves `status/{role}/{instance}`.
    pub is_service: bool,
}

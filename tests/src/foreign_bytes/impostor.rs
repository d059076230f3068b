//! A client that says it is a replica of every role and answers nonsense, and tokens without any replica.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use curionav_planning::random::rng;
use curionav_runtime::membership::announce;
use curionav_schemas::{GenerateReply, Message, OccupancyGrid, Scores, keys};
use curionav_testing::golden;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::spoilt::{below, spoilt};

const NAME: &str = "impostor";

/// Gone when dropped.
pub(super) struct Impostor {
    _tokens: Vec<LivelinessToken>,
    _queryables: Vec<Queryable<()>>,
    /// Answers given that are none.
    pub(super) nonsense: Arc<AtomicU64>,
}

impl Impostor {
    pub(super) fn start(session: &Session, seed: u64) -> Self {
        let nonsense: Arc<AtomicU64> = Arc::default();
        let served = [
            (
                keys::questions(keys::GENERATOR, NAME).unwrap(),
                "generate_reply",
                golden::generate_reply().encode(),
            ),
            (keys::questions("cpc", NAME).unwrap(), "scores", golden::scores().encode()),
            (keys::questions("cnc", NAME).unwrap(), "scores", golden::scores().encode()),
            // A map by another name is none: no service may take it for the one asked for.
            (format!("{}/map/*", keys::ROOT), "occupancy_grid", golden::occupancy_grid().encode()),
        ];
        let queryables = (served.into_iter().zip(0..))
            .map(|((key, message, honest), i)| {
                let (rng, count) = (Mutex::new(rng(seed, 90 + i)), Arc::clone(&nonsense));
                let of_the_pool = message != "occupancy_grid";
                let answer = move |query: Query| {
                    let mut rng = rng.lock().unwrap();
                    let wrong = spoilt(&mut rng, message);
                    let key = query.key_expr().clone();
                    let answered = match below(&mut rng, 8) {
                        // Says nothing at all.
                        0 => return,
                        // Well said, and not what was asked for.
                        1 | 2 => {
                            let encoding = match message {
                                "scores" => Scores::ENCODING,
                                "generate_reply" => GenerateReply::ENCODING,
                                _ => OccupancyGrid::ENCODING,
                            };
                            let _ = query.reply(key, honest.clone()).encoding(encoding).wait();
                            return;
                        }
                        3 => query.reply_err(wrong.bytes).encoding(wrong.encoding).wait(),
                        _ => query.reply(key, wrong.bytes).encoding(wrong.encoding).wait(),
                    };
                    if answered.is_ok() && of_the_pool {
                        count.fetch_add(1, Ordering::Relaxed);
                    }
                };
                session.declare_queryable(key).complete(true).callback(answer).wait().unwrap()
            })
            .collect();
        let mut tokens: Vec<LivelinessToken> =
            ["generator", "cpc", "cnc"].map(|role| announce(session, role, NAME).unwrap()).into();
        // No replica serves these, and the last ones are no names.
        for key in ["cpc/mute", "cnc/mute", "nonsense/a", "cpc/A B", "cpc/a/b/c", "cpc"] {
            let key = format!("{}/live/{key}", keys::ROOT);
            tokens.push(session.liveliness().declare_token(key).wait().unwrap());
        }
        Self { _tokens: tokens, _queryables: queryables, nonsense }
    }
}

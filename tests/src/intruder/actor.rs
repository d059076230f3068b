//! One program that tries everything. Nothing here waits for a time: a question that the router answers, or ends
//! because it is denied, shows that everything sent before it has been dealt with, and everything sent back before has
//! come.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use zenoh::handlers::FifoChannelHandler;
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Reply};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Session, Wait};

use super::cells::{Cells, Deed, is_concrete};
use super::site::{LIMIT, Router, connect};

/// What came, in any order.
type Log<T> = Arc<Mutex<Vec<T>>>;

fn log<T: Send + 'static>() -> (Log<T>, impl Fn(T) + Send + Sync + 'static) {
    let log = Log::<T>::default();
    let writer = Arc::clone(&log);
    (log, move |item| writer.lock().unwrap().push(item))
}

fn taken<T>(log: &Log<T>) -> Vec<T> {
    std::mem::take(&mut *log.lock().unwrap())
}

fn number(index: usize) -> Vec<u8> {
    index.to_le_bytes().to_vec()
}

fn index(bytes: &[u8]) -> Option<usize> {
    bytes.try_into().ok().map(usize::from_le_bytes)
}

pub(super) struct Actor<'a> {
    router: &'a Router,
    session: Session,
}

impl Drop for Actor<'_> {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}

impl<'a> Actor<'a> {
    pub(super) fn join(router: &'a Router, config: &Config) -> Self {
        let session = connect(config.clone(), &router.endpoint).expect("a certificate of the deployment");
        Self { router, session }
    }

    /// Everything that was sent has been dealt with, on both sides.
    fn settle(&self) {
        let replies = self.session.get("barrier").timeout(LIMIT).wait().unwrap();
        let began = std::time::Instant::now();
        while replies.recv().is_ok() {}
        assert!(began.elapsed() < LIMIT / 2, "a denied question ends at once");
    }

    /// The indices of the keys with which `deed` had an effect.
    pub(super) fn try_all(&self, deed: Deed, cells: &Cells) -> BTreeSet<usize> {
        match deed {
            Deed::Put => self.say(cells, SampleKind::Put),
            Deed::Delete => self.say(cells, SampleKind::Delete),
            Deed::Get => self.ask(cells),
            Deed::Token => self.hold(cells),
            Deed::Notice | Deed::Find => self.look_for_others(deed, cells),
            Deed::Subscribe => self.one_by_one(cells, |key| self.hear(cells, key)),
            Deed::Queryable => self.one_by_one(cells, |key| self.serve(cells, key)),
            Deed::LivelinessGet => self.watch(cells, |key| self.alive_now(key)),
            Deed::LivelinessSubscribe => self.watch(cells, |key| self.alive_from_now(key)),
        }
    }

    fn one_by_one(&self, cells: &Cells, is_done: impl Fn(&str) -> bool) -> BTreeSet<usize> {
        (0..cells.keys.len()).filter(|&index| is_done(&cells.keys[index])).collect()
    }

    fn say(&self, cells: &Cells, kind: SampleKind) -> BTreeSet<usize> {
        let (heard, hear) = log::<Sample>();
        let hear = Arc::new(hear);
        let hear_all = |key: &String| {
            let hear = Arc::clone(&hear);
            self.router
                .session
                .declare_subscriber(key.clone())
                .callback(move |sample| hear(sample))
                .wait()
                .unwrap()
        };
        let _listening: Vec<_> = cells.keys.iter().map(hear_all).collect();
        for (index, key) in cells.keys.iter().enumerate() {
            match kind {
                SampleKind::Put => self.session.put(key, number(index)).wait().unwrap(),
                SampleKind::Delete => self.session.delete(key).attachment(number(index)).wait().unwrap(),
            }
        }
        self.settle();
        let said = |sample: Sample| match sample.kind() {
            SampleKind::Put => index(&sample.payload().to_bytes()),
            SampleKind::Delete => sample.attachment().and_then(|number| index(&number.to_bytes())),
        };
        // A router also publishes about itself, in its admin space.
        taken(&heard).into_iter().filter_map(said).collect()
    }

    /// Questions that were asked and answered.
    fn ask(&self, cells: &Cells) -> BTreeSet<usize> {
        let answer = |query: Query| {
            let payload = query.payload().cloned().unwrap_or_default();
            query.reply(query.key_expr().clone(), payload).wait().unwrap();
        };
        let declare = |key: &String| {
            self.router.session.declare_queryable(key.clone()).complete(true).callback(answer).wait().unwrap()
        };
        let _serving: Vec<_> = cells.keys.iter().map(declare).collect();
        let ask = |(index, key): (usize, &String)| {
            self.session
                .get(key)
                .payload(number(index))
                .target(QueryTarget::All)
                .consolidation(ConsolidationMode::None)
                .timeout(LIMIT)
                .wait()
                .unwrap()
        };
        let asked: Vec<_> = cells.keys.iter().enumerate().map(ask).collect();
        // A session also answers itself about itself, without the router.
        let own = self.session.zid().to_string();
        let is_others = |reply: Reply| reply.result().is_ok_and(|sample| !sample.key_expr().contains(&own));
        let is_answered = |replies: &FifoChannelHandler<Reply>| {
            std::iter::from_fn(|| replies.recv().ok()).map(is_others).fold(false, |any, is_one| any | is_one)
        };
        (0..asked.len()).filter(|&index| is_answered(&asked[index])).collect()
    }

    fn hold(&self, cells: &Cells) -> BTreeSet<usize> {
        let (seen, see) = log::<Sample>();
        let see = Arc::new(see);
        let watch = |key: &String| {
            let see = Arc::clone(&see);
            let liveliness = self.router.session.liveliness();
            liveliness.declare_subscriber(key.clone()).callback(move |sample| see(sample)).wait().unwrap()
        };
        let _watching: Vec<_> = cells.keys.iter().map(watch).collect();
        let hold = |key: &String| self.session.liveliness().declare_token(key.clone()).wait().unwrap();
        let _held: Vec<_> = cells.keys.iter().map(hold).collect();
        self.settle();
        let seen: BTreeSet<String> =
            taken(&seen).iter().map(|sample| sample.key_expr().to_string()).collect();
        self.one_by_one(cells, |key| seen.contains(key))
    }

    /// Whether anything that is said under `key` is heard there.
    fn hear(&self, cells: &Cells, key: &str) -> bool {
        let (heard, hear) = log::<Sample>();
        let listening = self.session.declare_subscriber(key).callback(hear).wait().unwrap();
        self.settle();
        for said in cells.covered(key) {
            self.router.session.put(said, number(0)).wait().unwrap();
        }
        self.settle();
        drop(listening);
        !taken(&heard).is_empty()
    }

    /// Whether anything that is asked under `key` is answered from here.
    fn serve(&self, cells: &Cells, key: &str) -> bool {
        let answer = |query: Query| {
            // A question of the router itself, which it asks of everyone, is no question of the test.
            let _ = query.reply(query.key_expr().clone(), "answer").wait();
        };
        let serving = self.session.declare_queryable(key).complete(true).callback(answer).wait().unwrap();
        self.settle();
        let is_answered = |asked: &str| {
            let get = self.router.session.get(asked).target(QueryTarget::All).timeout(LIMIT);
            let replies = get.wait().unwrap();
            std::iter::from_fn(|| replies.recv().ok()).any(|reply| reply.result().is_ok())
        };
        let answered = cells.covered(key).any(is_answered);
        drop(serving);
        answered
    }

    /// With something alive under every concrete key.
    fn watch(&self, cells: &Cells, is_seen: impl Fn(&str) -> bool) -> BTreeSet<usize> {
        let hold = |key: &String| self.router.session.liveliness().declare_token(key.clone()).wait().unwrap();
        let _held: Vec<LivelinessToken> = cells.concrete.iter().map(hold).collect();
        // A session remembers the tokens that it was told of: what an intruder would try comes first, which is last in
        // the list.
        (0..cells.keys.len()).rev().filter(|&index| is_seen(&cells.keys[index])).collect()
    }

    fn alive_now(&self, key: &str) -> bool {
        let replies = self.session.liveliness().get(key).timeout(LIMIT).wait().unwrap();
        // What is denied here never ends.
        self.settle();
        std::iter::from_fn(|| replies.try_recv().ok().flatten()).any(|reply| reply.result().is_ok())
    }

    fn alive_from_now(&self, key: &str) -> bool {
        let (seen, see) = log::<Sample>();
        let liveliness = self.session.liveliness();
        let watching = liveliness.declare_subscriber(key).history(true).callback(see).wait().unwrap();
        self.settle();
        drop(watching);
        !taken(&seen).is_empty()
    }

    /// Whether it sees on a publisher that there are subscribers, or on a querier that there are queryables.
    fn look_for_others(&self, deed: Deed, cells: &Cells) -> BTreeSet<usize> {
        let of = &self.router.session;
        let concrete = cells.keys.iter().filter(|key| is_concrete(key));
        let (mut hearing, mut serving) = (Vec::new(), Vec::new());
        for key in concrete {
            match deed {
                Deed::Notice => {
                    hearing.push(of.declare_subscriber(key.clone()).callback(drop).wait().unwrap())
                }
                _ => serving.push(of.declare_queryable(key.clone()).callback(drop).wait().unwrap()),
            }
        }
        let is_seen = |key: &str| {
            let key = KeyExpr::try_from(key.to_owned()).unwrap();
            if !is_concrete(&key) {
                return false;
            }
            if deed == Deed::Notice {
                let publisher = self.session.declare_publisher(key).wait().unwrap();
                self.settle();
                publisher.matching_status().wait().unwrap().matching()
            } else {
                let querier = self.session.declare_querier(key).wait().unwrap();
                self.settle();
                querier.matching_status().wait().unwrap().matching()
            }
        };
        self.one_by_one(cells, is_seen)
    }
}

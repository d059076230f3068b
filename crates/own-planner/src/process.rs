//! A program that is asked on its standard input and answers on its standard output, a line each.
//!
//! Threads of their own write and read, so that a program which neither reads nor answers holds up nothing.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context;

/// Longest line that is read, bytes: 512 candidates of 256 poses have less.
const LINE_MOST: u64 = 16 << 20;
/// What is kept of what a program last said on standard error, bytes.
const SAID_MOST: usize = 4096;
/// How long it may take to end once its standard output has ended.
const END: Duration = Duration::from_millis(500);

/// Why there is no answer.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Silence {
    /// It did not come in time.
    Late,
    /// The program has ended, or said more than a line may have; why.
    Ended(String),
}

/// A running program; killed when dropped.
pub(crate) struct Process {
    child: Child,
    questions: Sender<Vec<u8>>,
    /// Closed at the end of its standard output.
    answers: Receiver<Vec<u8>>,
    said: Arc<Mutex<Vec<u8>>>,
    /// Closed at the end of its standard error.
    speaks: Receiver<()>,
    /// Answers that were late and have not come yet.
    owed: usize,
}

impl Process {
    pub(crate) fn start(mut command: Command) -> anyhow::Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let program = command.get_program().to_owned();
        let mut child =
            command.spawn().with_context(|| format!("cannot start {}", program.to_string_lossy()))?;
        let mut input = child.stdin.take().context("no standard input")?;
        let output = child.stdout.take().context("no standard output")?;
        let errors = child.stderr.take().context("no standard error")?;
        let (questions, asked) = channel::<Vec<u8>>();
        // It ends with the sender, or when the program no longer reads.
        spawn("planner-in", move || {
            while let Ok(line) = asked.recv() {
                if input.write_all(&line).and_then(|()| input.flush()).is_err() {
                    return;
                }
            }
        })?;
        let (answered, answers) = sync_channel(1);
        spawn("planner-out", move || {
            let mut output = BufReader::new(output);
            loop {
                let mut line = Vec::new();
                match output.by_ref().take(LINE_MOST).read_until(b'\n', &mut line) {
                    Ok(_) if line.last() == Some(&b'\n') => {}
                    _ => return,
                }
                if answered.send(line).is_err() {
                    return;
                }
            }
        })?;
        let said = Arc::<Mutex<Vec<u8>>>::default();
        let kept = Arc::clone(&said);
        let (speaking, speaks) = channel();
        spawn("planner-err", move || {
            let _speaking: Sender<()> = speaking;
            let mut errors = BufReader::new(errors);
            let mut bytes = [0; 1024];
            while let Ok(count @ 1..) = errors.read(&mut bytes) {
                let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                kept.extend_from_slice(&bytes[..count]);
                let surplus = kept.len().saturating_sub(SAID_MOST);
                kept.drain(..surplus);
            }
        })?;
        Ok(Self { child, questions, answers, said, speaks, owed: 0 })
    }

    /// The answer to `question`, a line without its end, if it comes within `limit`. One that comes later is thrown
    /// away, and until then nothing more is asked.
    pub(crate) fn ask(&mut self, mut question: Vec<u8>, limit: Duration) -> Result<Vec<u8>, Silence> {
        let deadline = Instant::now() + limit;
        while self.owed > 0 {
            self.next(deadline)?;
            self.owed -= 1;
        }
        question.push(b'\n');
        // A program that has ended is found out by the missing answer.
        let _ = self.questions.send(question);
        self.owed += 1;
        let answer = self.next(deadline)?;
        self.owed -= 1;
        Ok(answer)
    }

    fn next(&mut self, deadline: Instant) -> Result<Vec<u8>, Silence> {
        let left = deadline.saturating_duration_since(Instant::now());
        self.answers.recv_timeout(left).map_err(|error| match error {
            RecvTimeoutError::Timeout => Silence::Late,
            RecvTimeoutError::Disconnected => Silence::Ended(self.end()),
        })
    }

    /// How it has ended, once its standard output has; if it has not by then, it is ended.
    fn end(&mut self) -> String {
        let deadline = Instant::now() + END;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = self.child.kill();
        let how = match self.child.wait() {
            Ok(status) => format!("the program ended ({status})"),
            Err(error) => format!("the program ended ({error})"),
        };
        // Its last words may still be under way. What it has started may keep on speaking: that is not waited for.
        let _ = self.speaks.recv_timeout(END);
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let said = String::from_utf8_lossy(&said);
        match said.lines().rev().find(|line| !line.trim().is_empty()) {
            Some(last) => format!("{how}: {}", crate::lines::shown(last)),
            None => how,
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> anyhow::Result<()> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).context("cannot start a thread")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Process {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        Process::start(command).unwrap()
    }

    const LONG: Duration = Duration::from_secs(20);

    #[test]
    fn a_late_answer_is_never_taken_for_the_next_one() {
        // It answers the second question only when it has read the third line.
        let mut process = shell("read a; echo 1; read b; read c; echo 2; echo 3; cat >/dev/null");
        assert_eq!(process.ask(b"a".to_vec(), LONG).unwrap(), b"1\n");
        assert_eq!(process.ask(b"b".to_vec(), Duration::from_millis(20)), Err(Silence::Late));
        // Nothing more is asked, so the answer that is owed cannot come.
        assert_eq!(process.ask(b"c".to_vec(), Duration::from_millis(20)), Err(Silence::Late));
        let _ = process.questions.send(b"c\n".to_vec());
        let after = process.ask(b"d".to_vec(), LONG);
        assert_eq!(after.unwrap(), b"3\n");
    }

    #[test]
    fn an_end_is_told_with_the_last_words() {
        let mut process = shell("read a; echo first >&2; echo it broke >&2; exit 3");
        let ended = process.ask(b"a".to_vec(), LONG).unwrap_err();
        assert_eq!(ended, Silence::Ended("the program ended (exit status: 3): it broke".into()));
    }

    #[test]
    fn a_program_that_does_not_read_holds_up_nothing() {
        let mut process = shell("sleep 600");
        assert_eq!(process.ask(vec![b'x'; 4 << 20], Duration::from_millis(50)), Err(Silence::Late));
    }
}

//! What services ask of a cycle, and their answers once the cycle has taken it.

use dq_core::servo::Rejection;
use dq_messages::messages::SuccessResponse;
use std::sync::mpsc::Sender;
use std::time::Duration;
use tokio::sync::oneshot;

/// A cycle that has not taken a request after this long has other troubles.
pub(super) const PATIENCE: Duration = Duration::from_secs(1);

/// How the cycle says that it has taken a request.
#[derive(Debug)]
pub(super) struct Reply(oneshot::Sender<Result<(), Rejection>>);

impl Reply {
    /// Says that the request is taken. False where nobody waits any more: the answer was "not done" already.
    pub fn taken(self) -> bool {
        self.0.send(Ok(())).is_ok()
    }

    /// Says why the request is not taken.
    pub fn refused(self, why: Rejection) {
        // Who does not wait any more knows that it was not.
        let _ = self.0.send(Err(why));
    }

    /// Says what the servo has made of the request.
    pub fn answer(self, taken: Result<bool, Rejection>) {
        match taken {
            Ok(_) => drop(self.taken()),
            Err(why) => self.refused(why),
        }
    }

    /// Whether somebody still waits.
    pub fn is_awaited(&self) -> bool {
        !self.0.is_closed()
    }
}

/// Sends the request that `make` makes, and answers `done` once the cycle has taken it; waits for `patience` at most.
pub(super) async fn ask<R>(
    requests: &Sender<R>,
    make: impl FnOnce(Reply) -> R,
    done: &str,
    patience: Duration,
) -> SuccessResponse {
    let (reply, taken) = oneshot::channel();
    // One that cannot be sent is dropped with its reply.
    let _ = requests.send(make(Reply(reply)));
    let (success, message) = match tokio::time::timeout(patience, taken).await {
        Ok(Ok(Ok(()))) => (true, done.to_owned()),
        Ok(Ok(Err(why))) => (false, why.to_string()),
        Ok(Err(_)) => (false, "the cycle has ended".to_owned()),
        Err(_) => (false, format!("the cycle has not taken it within {} s", patience.as_secs_f64())),
    };
    SuccessResponse { success, message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[tokio::test]
    async fn a_request_succeeds_only_when_it_was_taken() {
        let (requests, inbox) = channel();
        let cycle = std::thread::spawn(move || inbox.recv().map(Reply::taken));
        let answer = ask(&requests, |reply| reply, "done", PATIENCE).await;
        assert_eq!((answer.success, answer.message.as_str()), (true, "done"));
        assert_eq!(cycle.join().unwrap(), Ok(true));

        let (requests, inbox) = channel::<Reply>();
        let why = Rejection::Late(Duration::from_secs(5));
        let cycle = std::thread::spawn(move || inbox.recv().map(|reply| reply.refused(why)));
        let answer = ask(&requests, |reply| reply, "done", PATIENCE).await;
        assert!(!answer.success && answer.message.contains("sent 5.0 s before it came"), "{answer:?}");
        assert_eq!(cycle.join().unwrap(), Ok(()));

        let (requests, inbox) = channel();
        let answer = ask(&requests, |reply| reply, "done", Duration::from_millis(10)).await;
        assert!(!answer.success && answer.message.contains("within 0.01 s"), "{answer:?}");
        assert!(!inbox.recv().unwrap().is_awaited());
        drop(inbox);
        let answer = ask(&requests, |reply| reply, "done", PATIENCE).await;
        assert!(!answer.success && answer.message.contains("ended"), "{answer:?}");
    }
}

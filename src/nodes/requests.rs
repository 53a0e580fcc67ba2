//! Requests that services send to the cycle, and the cycle's replies.

use dq_core::servo::Rejection;
use dq_messages::messages::SuccessResponse;
use std::sync::mpsc::Sender;
use std::time::Duration;
use tokio::sync::oneshot;

/// How long a service waits for the cycle to take its request.
pub(super) const PATIENCE: Duration = Duration::from_secs(1);

/// The cycle's reply to a request.
#[derive(Debug)]
pub(super) struct Reply(oneshot::Sender<Result<Option<String>, Rejection>>);

impl Reply {
    /// Replies that the cycle takes the request. Returns false if the service no longer waits: it has already answered that the request
    /// was not taken.
    pub fn taken(self) -> bool {
        self.0.send(Ok(None)).is_ok()
    }

    /// Replies with the reason why the request is refused.
    pub fn refused(self, why: Rejection) {
        // If nobody waits for the reply any more, the service has answered that the request was not taken.
        let _ = self.0.send(Err(why));
    }

    /// Replies that the request is taken if `taken` is `Ok`, otherwise with the reason why it is refused.
    pub fn answer(self, taken: Result<bool, Rejection>) {
        match taken {
            Ok(_) => drop(self.taken()),
            Err(why) => self.refused(why),
        }
    }

    /// Replies with the text of a result, or with the reason why the request failed.
    pub fn say(self, result: Result<String, Rejection>) {
        let _ = self.0.send(result.map(Some));
    }

    /// Returns whether the service still waits for the reply.
    pub fn is_awaited(&self) -> bool {
        !self.0.is_closed()
    }
}

/// Sends the request that `make` creates, and waits up to `patience` for the cycle's reply. If the cycle has taken the request,
/// returns a success with the text of the reply, or with `done` if the reply has no text. Otherwise returns a failure with the
/// reason.
pub(super) async fn ask<R>(
    requests: &Sender<R>,
    make: impl FnOnce(Reply) -> R,
    done: &str,
    patience: Duration,
) -> SuccessResponse {
    let (reply, taken) = oneshot::channel();
    // If sending fails, the reply is dropped, which ends the wait.
    let _ = requests.send(make(Reply(reply)));
    let (success, message) = match tokio::time::timeout(patience, taken).await {
        Ok(Ok(Ok(text))) => (true, text.unwrap_or_else(|| done.to_owned())),
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
        assert!(!answer.success && answer.message.contains("5.0 s after it was sent"), "{answer:?}");
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

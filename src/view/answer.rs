//! Answers to the requests of browsers.

use serde::Serialize;

/// The result of a request, in words for the user.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Whether the request succeeded.
    pub ok: bool,
    /// What was done, or the reason why nothing was done.
    pub text: String,
}

impl Answer {
    /// Creates the answer to a request that succeeded.
    pub fn done(text: impl Into<String>) -> Self {
        Self { ok: true, text: text.into() }
    }

    /// Creates the answer to a request that failed.
    pub fn refused(why: impl ToString) -> Self {
        Self { ok: false, text: why.to_string() }
    }

    /// Returns the JSON message that shows the answer to all browsers, including those that did not send the request.
    pub fn broadcast(&self) -> String {
        self.frame(None)
    }

    /// Returns the JSON message with this answer to the request number `id`. `id` is `None` if the answer is for all browsers, or
    /// if the browser's message was not a valid request.
    pub(super) fn frame(&self, id: Option<u32>) -> String {
        serde_json::json!({ "answer": { "id": id, "ok": self.ok, "text": self.text } }).to_string()
    }
}

//! What a browser is answered.

use serde::Serialize;

/// Whether something was done, in words for the user.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Done.
    pub ok: bool,
    /// What was done, or why not.
    pub text: String,
}

impl Answer {
    /// It was done.
    pub fn done(text: impl Into<String>) -> Self {
        Self { ok: true, text: text.into() }
    }

    /// It was not done.
    pub fn refused(why: impl ToString) -> Self {
        Self { ok: false, text: why.to_string() }
    }

    /// The frame that tells it to all browsers, of which none has asked.
    pub fn news(&self) -> String {
        self.frame(None)
    }

    /// The frame that carries the answer to the request `id`; none for what was no request.
    pub(super) fn frame(&self, id: Option<u32>) -> String {
        serde_json::json!({ "answer": { "id": id, "ok": self.ok, "text": self.text } }).to_string()
    }
}

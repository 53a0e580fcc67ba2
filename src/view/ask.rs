//! The requests of a browser.

use dq_common::text::cut;
use serde::Deserialize;

/// A message from a browser.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    /// The number of the request. The answer repeats it.
    pub id: u32,
    /// The request.
    pub ask: Ask,
}

/// What a browser can request. A browser that may only watch cannot send requests.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// Go to a pose in the goal frame: the base frame or, for two arms, the left tool's frame.
    Goal {
        /// The position x, y, z \[m\].
        position: [f64; 3],
        /// The quaternion x, y, z, w.
        orientation: [f64; 4],
    },
    /// Move the tool at this velocity until the servo's twist timeout has passed.
    Jog {
        /// The tool point's velocity along the axes of the goal frame [m/s].
        linear: [f64; 3],
        /// The tool's angular velocity about the same axes [rad/s].
        angular: [f64; 3],
    },
    /// Set a parameter of the servo.
    Set {
        /// The name of the parameter.
        name: String,
        /// The value: a boolean, a number or a text.
        value: serde_json::Value,
    },
    /// Bring the arm to rest, and keep the goal.
    Pause,
    /// Resume after a pause.
    Resume,
    /// Bring the arm to rest, and drop the goal.
    Stop,
    /// Put the simulated arms back to their start.
    Reset,
    /// Send two simulated arms to the same goal under two laws.
    Race {
        /// The names of the two laws.
        laws: [String; 2],
    },
    /// Begin a recording.
    Record,
    /// End the recording.
    EndRecording,
}

impl Request {
    /// Parses a request from a text message.
    ///
    /// # Errors
    /// The reason why the text is not a valid request, as a sentence.
    pub fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|why| format!("not a request: {}", cut(&why.to_string())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_and_nothing_else_is() {
        let read = |text| Request::read(text);
        assert_eq!(read(r#"{"id":3,"ask":"stop"}"#), Ok(Request { id: 3, ask: Ask::Stop }));
        let goal = r#"{"id":4,"ask":{"goal":{"position":[1,2,3],"orientation":[0,0,0,1]}}}"#;
        let expected = Ask::Goal { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.0, 0.0, 1.0] };
        assert_eq!(read(goal), Ok(Request { id: 4, ask: expected }));
        for no_request in [
            "",
            "stop",
            r#"{"ask":"stop"}"#,
            r#"{"id":-1,"ask":"stop"}"#,
            r#"{"id":1,"ask":"stop","more":1}"#,
            r#"{"id":1,"ask":"shutdown"}"#,
            r#"{"id":1,"ask":{"goal":{"position":[1,2],"orientation":[0,0,0,1]}}}"#,
            r#"{"id":1,"ask":{"goal":{"position":[1,2,1e999],"orientation":[0,0,0,1]}}}"#,
            r#"{"id":1,"ask":{"goal":{"position":[1,2,null],"orientation":[0,0,0,1]}}}"#,
        ] {
            let why = read(no_request).unwrap_err();
            assert!(why.starts_with("not a request: ") && why.len() < 300, "{no_request}: {why}");
        }
    }
}

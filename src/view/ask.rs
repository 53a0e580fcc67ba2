//! What a browser may ask.

use dq_common::text::cut;
use serde::Deserialize;

/// A frame from a browser.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    /// Repeated in the answer.
    pub id: u32,
    /// What is asked.
    pub ask: Ask,
}

/// What is asked of the robot. All of it drives: who may only watch asks nothing.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// To go to a pose in the base frame.
    Goal {
        /// x, y, z \[m\].
        position: [f64; 3],
        /// The quaternion x, y, z, w.
        orientation: [f64; 4],
    },
    /// To move the tool for a moment.
    Jog {
        /// The tool point's velocity along the axes of the frame of goals [m/s].
        linear: [f64; 3],
        /// The tool's angular velocity about them [rad/s].
        angular: [f64; 3],
    },
    /// To set a parameter of the servo.
    Set {
        /// The parameter.
        name: String,
        /// A bool, a number or a text.
        value: serde_json::Value,
    },
    /// To bring the arm to rest and keep the goal.
    Pause,
    /// To go on after a pause.
    Resume,
    /// To bring the arm to rest and drop the goal.
    Stop,
    /// To put a simulated arm back to its start.
    Reset,
    /// To send two simulated arms to the same goal under two laws, side by side.
    Race {
        /// The laws.
        laws: [String; 2],
    },
    /// To begin a recording.
    Record,
    /// To end the recording.
    EndRecording,
}

impl Request {
    /// Reads a text frame.
    ///
    /// # Errors
    /// Why it is no request, in a sentence.
    pub fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|why| format!("no request: {}", cut(&why.to_string())))
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
            assert!(why.starts_with("no request: ") && why.len() < 300, "{no_request}: {why}");
        }
    }
}

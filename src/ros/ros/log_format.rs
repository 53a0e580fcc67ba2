//! The format of log lines.

use super::args::LogLevel;
use chrono::{DateTime, Local};
use dq_messages::messages::Time;
use std::sync::LazyLock;

/// The environment variable in which ROS 2 users set the format of log lines.
const VARIABLE: &str = "RCUTILS_CONSOLE_OUTPUT_FORMAT";

/// The default format: the default of ROS 2, but with the time of day instead of the seconds since 1970.
const DEFAULT: &str = "[{severity}] [{clock}] [{name}]: {message}";

/// The format of this process's log lines.
static FORMAT: LazyLock<String> = LazyLock::new(|| {
    let given = std::env::var(VARIABLE).ok().filter(|format| !format.is_empty());
    given.map_or_else(|| DEFAULT.to_owned(), |format| with_escapes(&format))
});

/// Formats a message of the node `name` in the process's format.
pub(super) fn line(level: LogLevel, stamp: &Time, name: &str, message: &str) -> String {
    Entry { level, stamp, name, message }.expand(&FORMAT)
}

struct Entry<'a> {
    level: LogLevel,
    stamp: &'a Time,
    name: &'a str,
    message: &'a str,
}

impl Entry<'_> {
    /// Replaces every known token in braces, and leaves other text unchanged.
    fn expand(&self, format: &str) -> String {
        let mut line = String::new();
        let mut rest = format;
        while let Some((before, token, after)) = next_token(rest) {
            line.push_str(before);
            match self.value(token) {
                Some(value) => {
                    line.push_str(&value);
                    rest = after;
                }
                None => {
                    line.push('{');
                    rest = &rest[before.len() + 1..];
                }
            }
        }
        line + rest
    }

    /// Returns the value of a token of rcutils; `None` for an unknown token. The tokens for the location in the source
    /// code give an empty text, because the location is not known.
    fn value(&self, token: &str) -> Option<String> {
        Some(match token {
            "severity" => format!("{:?}", self.level).to_uppercase(),
            "name" => self.name.to_owned(),
            "message" => self.message.to_owned(),
            "time" => self.stamp.to_string(),
            "time_as_nanoseconds" => self.stamp.nanoseconds().to_string(),
            "date_time_with_ms" => self.local("%Y-%m-%d %H:%M:%S%.3f"),
            "clock" => self.local("%H:%M:%S%.3f"),
            "function_name" | "file_name" | "line_number" => String::new(),
            _ => return None,
        })
    }

    fn local(&self, format: &str) -> String {
        DateTime::from_timestamp_nanos(self.stamp.nanoseconds())
            .with_timezone(&Local)
            .format(format)
            .to_string()
    }
}

/// Returns the text before the first brace, the text in the braces, and the text after them.
fn next_token(text: &str) -> Option<(&str, &str, &str)> {
    let (before, from) = text.split_once('{')?;
    let (token, after) = from.split_once('}')?;
    Some((before, token, after))
}

/// Replaces the escape sequences that rcutils knows.
fn with_escapes(format: &str) -> String {
    let escapes = [(r"\a", "\x07"), (r"\b", "\x08"), (r"\n", "\n"), (r"\r", "\r"), (r"\t", "\t")];
    escapes.iter().fold(format.to_owned(), |text, (escape, meant)| text.replace(escape, meant))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAMP: Time = Time { sec: 1_700_000_000, nanosec: 219_000_000 };

    fn line(format: &str) -> String {
        let entry =
            Entry { level: LogLevel::Warn, stamp: &STAMP, name: "arm.servo", message: "a {time} passes" };
        entry.expand(&with_escapes(format))
    }

    #[test]
    fn tokens_of_rcutils_are_expanded_once_and_all_other_text_is_kept() {
        for (format, expected) in [
            (
                "[{severity}] [{time}] [{name}]: {message}",
                "[WARN] [1700000000.219000000] [arm.servo]: a {time} passes",
            ),
            ("{time_as_nanoseconds}", "1700000000219000000"),
            ("{file_name}:{line_number}{function_name}", ":"),
            (r"a\tb\nc", "a\tb\nc"),
            ("{other} {{name} } {", "{other} {arm.servo } {"),
            ("", ""),
        ] {
            assert_eq!(line(format), expected, "{format}");
        }
    }

    #[test]
    fn the_clock_is_the_end_of_the_date_with_milliseconds() {
        let (date, clock) = (line("{date_time_with_ms}"), line("{clock}"));
        assert!(date.ends_with(&format!(" {clock}")), "{date} {clock}");
        // Every time zone of 2023 is a whole number of minutes from UTC.
        assert!(clock.ends_with(":20.219") && clock.len() == "12:03:44.219".len(), "{clock}");
    }
}

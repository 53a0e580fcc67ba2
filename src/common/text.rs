//! Text and lists that come from outside: cut, or refused, before they are kept, logged or repeated.

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// The longest text from outside that is taken whole \[bytes\]. Every ROS 2 name is shorter.
pub const LONGEST: usize = 250;

/// The longest list from outside that is taken. No robot has so many joints; looking through more takes longer than a cycle.
pub const MOST: usize = 100_000;

const ELLIPSIS: char = '…';

/// The text, or its first [`LONGEST`] bytes with an ellipsis among them.
pub fn cut(text: &str) -> Cow<'_, str> {
    if text.len() <= LONGEST {
        return Cow::Borrowed(text);
    }
    let end = (0..=LONGEST - ELLIPSIS.len_utf8()).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    Cow::Owned(format!("{}{ELLIPSIS}", &text[..end]))
}

/// How much of a name from outside is shown \[characters\].
pub const NAME: usize = 80;
/// How much of what is wrong with a file from outside is shown \[characters\].
pub const REASON: usize = 400;

/// A text from outside as it can stand in a figure, a table and a line: without control characters, and no longer than `longest`.
pub fn shown(text: &str, longest: usize) -> String {
    let clean = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = text.chars().take(longest).map(clean).collect();
    if text.chars().nth(longest).is_some() {
        shown.push(ELLIPSIS);
    }
    shown
}

/// A text from outside as it is, in its lines, but without control characters that could drive a terminal.
pub fn shown_lines(text: &str) -> String {
    let clean = |c: char| match c {
        '\n' | '\t' => c,
        _ if c.is_control() => char::REPLACEMENT_CHARACTER,
        _ => c,
    };
    text.chars().map(clean).collect()
}

/// Text as it stands in XML, also between quotes.
pub fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, character| {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML has no way to write most of these.
            control if control.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            other => out.push(other),
        }
        out
    })
}

/// Deserializes a text, cut before it is copied.
///
/// # Errors
/// The deserializer's.
pub fn deserialize_cut<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Short::deserialize(deserializer).map(|Short(text)| text)
}

/// Deserializes a list of texts, each cut, of [`MOST`] at most.
///
/// # Errors
/// The deserializer's; a longer list is read no further.
pub fn deserialize_cuts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let texts: Vec<Short> = deserialize_few(deserializer)?;
    Ok(texts.into_iter().map(|Short(text)| text).collect())
}

/// Deserializes a list of [`MOST`] elements at most.
///
/// # Errors
/// The deserializer's; a longer list is read no further.
pub fn deserialize_few<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    deserializer.deserialize_seq(Few(PhantomData))
}

/// A text that was cut where it came in.
struct Short(String);

impl<'de> Deserialize<'de> for Short {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Short;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a text")
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Short, E> {
                Ok(Short(cut(text).into_owned()))
            }
        }
        deserializer.deserialize_str(Text)
    }
}

struct Few<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Few<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a list of {MOST} elements at most")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut input: A) -> Result<Vec<T>, A::Error> {
        let mut list = Vec::new();
        while let Some(element) = input.next_element()? {
            if list.len() == MOST {
                return Err(A::Error::custom(format!("a list of more than {MOST} elements")));
            }
            list.push(element);
        }
        Ok(list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_long_text_is_cut_with_an_ellipsis() {
        let long = "x".repeat(LONGEST + 1);
        assert_eq!(cut(&long), format!("{}…", "x".repeat(LONGEST - 3)));
        assert_eq!(cut(&long[..LONGEST]), long[..LONGEST]);
    }

    #[test]
    fn a_shown_text_is_one_short_line() {
        assert_eq!(shown("a\nb\u{1b}[2J", 80), "a\u{fffd}b\u{fffd}[2J");
        assert_eq!(shown("äöü", 3), "äöü");
        assert_eq!(shown("äöüx", 3), "äöü…");
    }

    #[test]
    fn a_text_in_lines_keeps_them_and_drives_no_terminal() {
        let robot = "<robot>\n\t<link name=\"ä\"/>\n</robot>\n";
        assert_eq!(shown_lines(robot), robot);
        assert_eq!(shown_lines("a\r\u{1b}[2J\u{9b}b\0"), "a\u{fffd}\u{fffd}[2J\u{fffd}b\u{fffd}");
    }

    proptest! {
        #[test]
        fn what_is_left_is_a_beginning_and_never_too_long(text in "(a|ä|🤖){0,300}") {
            let short = cut(&text);
            prop_assert!(short.len() <= LONGEST);
            prop_assert!(text.starts_with(short.strip_suffix(ELLIPSIS).unwrap_or(&short)));
        }
    }
}

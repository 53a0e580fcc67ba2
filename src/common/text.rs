//! Functions for text and lists from other programs and files. They shorten, clean or refuse such data before the program stores,
//! logs or repeats them.

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// The largest length of a text from another program or a file \[bytes\]; longer texts are shortened. Every ROS 2 name is shorter
/// than this.
pub const LONGEST: usize = 250;

/// The largest number of elements of a list from another program or a file; longer lists are refused. No robot has this many joints,
/// and processing a longer list would take longer than a cycle.
pub const MOST: usize = 100_000;

const ELLIPSIS: char = '…';

/// Returns `text` if it has at most [`LONGEST`] bytes. Otherwise returns the beginning of `text` followed by an ellipsis,
/// together at most [`LONGEST`] bytes.
pub fn cut(text: &str) -> Cow<'_, str> {
    if text.len() <= LONGEST {
        return Cow::Borrowed(text);
    }
    let end = (0..=LONGEST - ELLIPSIS.len_utf8()).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    Cow::Owned(format!("{}{ELLIPSIS}", &text[..end]))
}

/// The largest number of characters that are shown of a name from another program or a file. Longer names are cut.
pub const NAME: usize = 80;
/// The largest number of characters that are shown of an error message about a file. Longer messages are cut.
pub const REASON: usize = 400;

/// Returns `text` in a form that is safe to show in a figure, a table or a line. Replaces control characters. If the text has more
/// than `longest` characters, returns the first `longest` and an ellipsis.
pub fn shown(text: &str, longest: usize) -> String {
    let clean = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = text.chars().take(longest).map(clean).collect();
    if text.chars().nth(longest).is_some() {
        shown.push(ELLIPSIS);
    }
    shown
}

/// Returns `text` in a form that is safe to print. Keeps line breaks and tabs, and replaces all other control characters, which
/// could control a terminal.
pub fn shown_lines(text: &str) -> String {
    let clean = |c: char| match c {
        '\n' | '\t' => c,
        _ if c.is_control() => char::REPLACEMENT_CHARACTER,
        _ => c,
    };
    text.chars().map(clean).collect()
}

/// Escapes a text for XML. The result may also be used in an attribute.
pub fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, character| {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML cannot represent most control characters.
            control if control.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            other => out.push(other),
        }
        out
    })
}

/// Deserializes a text. Shortens the text to [`LONGEST`] bytes before it is copied.
///
/// # Errors
/// Returns the deserializer's error.
pub fn deserialize_cut<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Short::deserialize(deserializer).map(|Short(text)| text)
}

/// Deserializes a list of at most [`MOST`] texts, and shortens each text.
///
/// # Errors
/// Returns the deserializer's error, or an error for a longer list. A longer list is not read to its end.
pub fn deserialize_cuts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let texts: Vec<Short> = deserialize_few(deserializer)?;
    Ok(texts.into_iter().map(|Short(text)| text).collect())
}

/// Deserializes a list of at most [`MOST`] elements.
///
/// # Errors
/// Returns the deserializer's error, or an error for a longer list. A longer list is not read to its end.
pub fn deserialize_few<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    deserializer.deserialize_seq(Few(PhantomData))
}

/// A text that is cut to [`LONGEST`] bytes when it is deserialized.
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
    fn line_breaks_stay_and_control_characters_are_replaced() {
        let robot = "<robot>\n\t<link name=\"ä\"/>\n</robot>\n";
        assert_eq!(shown_lines(robot), robot);
        assert_eq!(shown_lines("a\r\u{1b}[2J\u{9b}b\0"), "a\u{fffd}\u{fffd}[2J\u{fffd}b\u{fffd}");
    }

    proptest! {
        #[test]
        fn a_cut_text_is_a_prefix_and_never_too_long(text in "(a|ä|🤖){0,300}") {
            let short = cut(&text);
            prop_assert!(short.len() <= LONGEST);
            prop_assert!(text.starts_with(short.strip_suffix(ELLIPSIS).unwrap_or(&short)));
        }
    }
}

//! Reads robot descriptions that are not XML, but that ROS 2's own parser (urdfdom with tinyxml2) accepts. Converts them to XML,
//! line by line, for the strict parser.
//!
//! The grammar is that of tinyxml2 (11.0). quick-xml (0.42) rejects a tenth of the documents that tinyxml2 accepts: documents with
//! blanks after `<`, or with a `<!…>` other than DOCTYPE.

use super::arm::DescriptionError;
use dq_common::text::cut;

/// The delimiters of markup that is not an element. The first delimiter that fits counts, so a longer delimiter comes before a
/// shorter delimiter with the same beginning.
const MARKS: [(&str, &str); 4] = [("?", "?>"), ("!--", "-->"), (CDATA, "]]>"), ("!", ">")];
const CDATA: &str = "![CDATA[";

/// Returns the first `<robot>` of `text` as XML. Each element keeps its line number.
///
/// # Errors
/// [`DescriptionError::NotXml`] for a text that even tinyxml2 rejects, and [`DescriptionError::Xacro`] for a xacro macro.
pub(crate) fn as_xml(text: &str) -> Result<String, DescriptionError> {
    // A C string ends at the first NUL.
    let all = text.split('\0').next().unwrap_or_default();
    let (mut rest, mut xml) = (all, Xml::default());
    while let Some((before, from)) = rest.split_once('<') {
        // The line is computed only for an error: for each element it would take quadratic time.
        let line = || line(all, all.len() - from.len());
        let missing = |what: &str| DescriptionError::NotXml(format!("expected {what} in line {}", line()));
        xml.put(before, &escaped(before));
        let mark = MARKS.iter().find_map(|(open, close)| Some((*open, *close, from.strip_prefix(open)?)));
        rest = match mark {
            Some((open, close, inside)) => {
                let (inside, after) = inside.split_once(close).ok_or_else(|| missing(close))?;
                let data = if open == CDATA { inside.replace('&', "&amp;") } else { String::new() };
                xml.put(inside, &escaped(&data));
                after
            }
            None => {
                let (tag, after) = Tag::read(from).map_err(missing)?;
                if tag.name.starts_with("xacro:") {
                    return Err(DescriptionError::Xacro {
                        element: cut(tag.name).into_owned(),
                        line: line(),
                    });
                }
                xml.element(&from[..from.len() - after.len()], &tag);
                after
            }
        };
    }
    Ok(xml.out)
}

/// Returns the number of the line at the byte offset `at`, counted from 1.
pub(crate) fn line(text: &str, at: usize) -> u32 {
    let before = text.as_bytes().iter().take(at).filter(|byte| **byte == b'\n').count();
    u32::try_from(before + 1).unwrap_or(u32::MAX)
}

/// A start tag, an end tag, or an empty-element tag.
struct Tag<'a> {
    name: &'a str,
    attributes: Vec<(&'a str, &'a str)>,
    /// Whether the tag is an end tag.
    is_end: bool,
    /// Whether the tag is an empty-element tag.
    is_whole: bool,
}

impl<'a> Tag<'a> {
    /// Reads the tag after a `<`. Returns the tag with the rest of the text.
    ///
    /// # Errors
    /// A description of the missing part.
    fn read(text: &'a str) -> Result<(Self, &'a str), &'static str> {
        let text = text.trim_ascii_start();
        let (is_end, text) = text.strip_prefix('/').map_or((false, text), |text| (true, text));
        let (name, mut rest) = name(text).ok_or("the name of an element after <")?;
        let mut attributes = Vec::new();
        loop {
            rest = rest.trim_ascii_start();
            if let Some((is_whole, after)) = ending(rest) {
                return Ok((Self { name, attributes, is_end, is_whole }, after));
            }
            let (key, after) = self::name(rest).ok_or("an attribute, > or />")?;
            let value = after.trim_ascii_start().strip_prefix('=').ok_or("= after an attribute's name")?;
            let value = value.trim_ascii_start();
            let quote = value.chars().next().filter(|quote| ['"', '\''].contains(quote));
            let (value, after) = quote
                .and_then(|quote| value[1..].split_once(quote))
                .ok_or("the value of an attribute in quotes")?;
            attributes.push((key, value));
            rest = after;
        }
    }
}

/// Reads the end of a tag. Returns whether the tag is an empty element, and the rest of the text; `None` if the tag does not end
/// here.
fn ending(text: &str) -> Option<(bool, &str)> {
    let whole = text.strip_prefix("/>").map(|after| (true, after));
    whole.or_else(|| text.strip_prefix('>').map(|after| (false, after)))
}

/// Reads a name. Returns the name with the rest of the text; `None` if there is no name.
fn name(text: &str) -> Option<(&str, &str)> {
    let is_first = |c: char| c.is_ascii_alphabetic() || !c.is_ascii() || [':', '_'].contains(&c);
    let is_more = |c: char| is_first(c) || c.is_ascii_digit() || ['.', '-'].contains(&c);
    text.starts_with(is_first).then(|| text.split_at(text.find(|c| !is_more(c)).unwrap_or(text.len())))
}

/// The writer of the corrected XML document.
#[derive(Default)]
struct Xml {
    out: String,
    depth: usize,
    /// Whether the output is inside the robot element.
    is_robot: bool,
    /// Whether the robot element has ended.
    is_after: bool,
}

impl Xml {
    /// Writes `text` in place of `read`, which is a part of the input. Outside the robot element, writes no text. If `read` has more
    /// line ends than the written text, adds the missing ones, so that the elements keep their line numbers.
    fn put(&mut self, read: &str, text: &str) {
        let text = if self.is_robot { text } else { "" };
        let lines = [read, text].map(|text| text.matches('\n').count());
        self.out.push_str(text);
        self.out.extend(std::iter::repeat_n('\n', lines[0].saturating_sub(lines[1])));
    }

    fn element(&mut self, read: &str, tag: &Tag) {
        if self.depth == 0 && !tag.is_end {
            self.is_robot = tag.name == "robot" && !self.is_after;
        }
        let name = plain(tag.name);
        let mut text = if tag.is_end { format!("</{name}>") } else { format!("<{name}") };
        if !tag.is_end {
            let attributes = tag.attributes.iter();
            let attributes = attributes.filter(|(key, _)| *key != "xmlns" && !key.starts_with("xmlns:"));
            attributes.for_each(|(key, value)| {
                text.push_str(&format!(" {}=\"{}\"", plain(key), escaped(value)));
            });
            text.push_str(if tag.is_whole { "/>" } else { ">" });
        }
        self.put(read, &text);
        match (tag.is_end, tag.is_whole) {
            (false, false) => self.depth += 1,
            (true, _) => self.depth = self.depth.saturating_sub(1),
            (false, true) => {}
        }
        if self.depth == 0 && self.is_robot {
            (self.is_robot, self.is_after) = (false, true);
        }
    }
}

/// Returns a name with its colons replaced by `_`, so that no parser takes the part before a colon for a namespace. The prefix `a:`
/// of `a:b` must not be removed: tinyxml2 knows no namespaces, so to tinyxml2 `a:b` and `b` are different names.
fn plain(name: &str) -> String {
    name.replace(':', "_")
}

/// Escapes all characters that are not allowed in XML text, except entities.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for (at, character) in text.char_indices() {
        match character {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '&' if !is_entity(&text[at + 1..]) => out.push_str("&amp;"),
            '\n' | '\t' | '\r' => out.push(character),
            control if control.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            other => out.push(other),
        }
    }
    out
}

/// The longest name of an entity \[bytes\]. A search for the end of a longer name would take quadratic time.
const LONGEST_ENTITY: usize = 16;

/// Returns whether `rest`, the text after an ampersand, completes an XML entity.
fn is_entity(rest: &str) -> bool {
    let end = rest.bytes().take(LONGEST_ENTITY + 1).position(|byte| byte == b';');
    let Some(name) = end.map(|end| &rest[..end]) else { return false };
    let number = name.strip_prefix("#x").map(|hex| u32::from_str_radix(hex, 16));
    let number = number.or_else(|| name.strip_prefix('#').map(str::parse));
    match number {
        Some(number) => number.ok().and_then(char::from_u32).is_some_and(|character| !character.is_control()),
        None => ["amp", "lt", "gt", "quot", "apos"].contains(&name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_keep_their_lines_and_prefixes_become_part_of_names() {
        let text = "\n<?xml version=1.0?>\n<!-- a -- b\n-->\n<other/><robot name='a \"b\" < c & d &amp; e'\n xmlns:p=\"q\">\n\
                    <p:link/> <![CDATA[<&]]></robot>\n<robot name=\"second\"/>";
        let expected = "\n\n\n\n<robot name=\"a &quot;b&quot; &lt; c &amp; d &amp; e\">\n\n<p_link/> &lt;&amp;</robot>\n";
        assert_eq!(as_xml(text).unwrap(), expected);
    }

    /// A parser with quadratic running time would take minutes for each of these texts.
    #[test]
    fn the_time_is_proportional_to_the_length_of_the_text() {
        let began = std::time::Instant::now();
        let ampersands = "&".repeat(4 << 20);
        let escaped = as_xml(&format!("<robot>{ampersands}</robot>")).unwrap();
        assert_eq!(escaped.matches("&amp;").count(), 4 << 20);
        let comments = as_xml(&format!("<robot>{}</robot>", "<!-- a -- b -->\n".repeat(200_000))).unwrap();
        assert_eq!(comments.lines().count(), 200_001);
        assert!(began.elapsed() < std::time::Duration::from_secs(10), "{:?}", began.elapsed());
    }

    #[test]
    fn a_missing_part_is_named_with_its_line() {
        let why = |text: &str| as_xml(text).unwrap_err().to_string();
        for (text, what) in [
            ("<robot>\n<!-- a", "--> in line 2"),
            ("<robot name=a>", "the value of an attribute in quotes in line 1"),
            ("\n\n<robot name>", "= after an attribute's name in line 3"),
            ("<robot", "an attribute, > or /> in line 1"),
            ("<1/>", "the name of an element after < in line 1"),
        ] {
            assert_eq!(why(text), format!("the robot description is no XML: expected {what}"));
        }
        assert!(why("<robot>\n<xacro:macro/>").starts_with("<xacro:macro> in line 2"));
    }
}

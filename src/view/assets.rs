//! The files of the page, all inside the program, and the headers that they are served with.

use crate::control::Law;
use crate::draw::{AXES, COMPONENTS, law_color};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::response::{IntoResponse, Response};

/// A file: its path, its type and its content.
type Asset = (&'static str, &'static str, &'static str);

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

const FILES: [Asset; 8] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/style.css", STYLE, include_str!("page/style.css")),
    ("/main.js", SCRIPT, include_str!("page/main.js")),
    ("/connection.js", SCRIPT, include_str!("page/connection.js")),
    ("/curves.js", SCRIPT, include_str!("page/curves.js")),
    ("/parameters.js", SCRIPT, include_str!("page/parameters.js")),
    ("/scene.js", SCRIPT, include_str!("page/scene.js")),
    ("/space.js", SCRIPT, include_str!("page/space.js")),
];

/// Nothing from elsewhere, nothing written into the page, in nobody's frame.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, HeaderValue); 7] = [
    (CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY)),
    (X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (CACHE_CONTROL, HeaderValue::from_static("no-store")),
    (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
];

/// The paths that are served.
pub(super) fn paths() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(path, ..)| *path).chain(["/colors.css"])
}

/// The file at `path`, which is one of [`paths`].
pub(super) fn file(path: &str) -> Response {
    match FILES.iter().find(|(known, ..)| *known == path) {
        Some((_, kind, content)) => ([(CONTENT_TYPE, *kind)], *content).into_response(),
        None => ([(CONTENT_TYPE, STYLE)], colors()).into_response(),
    }
}

/// The same response with the headers that every one of this server has.
pub(super) fn guarded(mut response: Response) -> Response {
    response.headers_mut().extend(HEADERS.map(|(name, value)| (Some(name), value)));
    response
}

/// The figures' own colours, for the page's style sheet and scripts.
fn colors() -> String {
    let laws = Law::ALL.iter().map(|law| (format!("law-{}", law.name()), law_color(*law)));
    let axes = ["axis-x", "axis-y", "axis-z"].map(str::to_owned).into_iter().zip(AXES);
    let components = COMPONENTS.into_iter().enumerate().map(|(i, color)| (format!("component-{i}"), color));
    let lines = laws.chain(axes).chain(components);
    let line = |(name, color): (String, plotters::style::RGBColor)| {
        format!("  --{name}: #{:02x}{:02x}{:02x};\n", color.0, color.1, color.2)
    };
    format!(":root {{\n{}}}\n", lines.map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_small_and_asks_nothing_of_others() {
        let bytes: usize = FILES.iter().map(|(.., content)| content.len()).sum();
        assert!(bytes + colors().len() < 2_000_000, "{bytes}");
        for (path, _, content) in FILES {
            for elsewhere in ["http://", "https://", "//cdn", "@import", "eval("] {
                // Names of XML are no addresses.
                let content = content.replace("http://www.w3.org/2000/svg", "");
                assert!(!content.contains(elsewhere), "{path}: {elsewhere}");
            }
        }
    }

    #[test]
    fn the_page_has_the_figures_colors() {
        let colors = colors();
        assert!(
            colors.contains("--law-diffc: #0072b2;") && colors.contains("--law-logc: #d55e00;"),
            "{colors}"
        );
        assert_eq!(colors.matches("--law-").count(), Law::ALL.len());
    }
}

//! The built-in files of the page, and their HTTP headers.

use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::response::{IntoResponse, Response};
use dq_figures::{AXES, COMPONENTS, Color, law_color};
use dq_kinematics::control::Law;

/// A file: its path, its type and its content.
type Asset = (&'static str, &'static str, &'static str);

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

const FILES: [Asset; 21] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/style.css", STYLE, include_str!("page/style.css")),
    ("/main.js", SCRIPT, include_str!("page/main.js")),
    ("/body.js", SCRIPT, include_str!("page/body.js")),
    ("/connection.js", SCRIPT, include_str!("page/connection.js")),
    ("/curves.js", SCRIPT, include_str!("page/curves.js")),
    ("/drawing.js", SCRIPT, include_str!("page/drawing.js")),
    ("/goal.js", SCRIPT, include_str!("page/goal.js")),
    ("/handles.js", SCRIPT, include_str!("page/handles.js")),
    ("/jog.js", SCRIPT, include_str!("page/jog.js")),
    ("/limits.js", SCRIPT, include_str!("page/limits.js")),
    ("/arm_shape.js", SCRIPT, include_str!("page/arm_shape.js")),
    ("/parameters.js", SCRIPT, include_str!("page/parameters.js")),
    ("/player.js", SCRIPT, include_str!("page/player.js")),
    ("/run.js", SCRIPT, include_str!("page/run.js")),
    ("/scene.js", SCRIPT, include_str!("page/scene.js")),
    ("/solids.js", SCRIPT, include_str!("page/solids.js")),
    ("/space.js", SCRIPT, include_str!("page/space.js")),
    ("/stage.js", SCRIPT, include_str!("page/stage.js")),
    ("/texts.js", SCRIPT, include_str!("page/texts.js")),
    ("/theatre.js", SCRIPT, include_str!("page/theatre.js")),
];

/// The security policy for the browser. The browser loads nothing from other servers, runs no inline code, and does not show the
/// page in a frame.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'; connect-src 'self'";

const HEADERS: [(HeaderName, HeaderValue); 6] = [
    (X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (CACHE_CONTROL, HeaderValue::from_static("no-store")),
    (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
];

/// Returns the page for a browser without a token.
pub(super) fn for_strangers() -> Response {
    ([(CONTENT_TYPE, "text/html; charset=utf-8")], include_str!("page/stranger.html")).into_response()
}

/// Returns the paths that are served.
pub(super) fn paths() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(path, ..)| *path).chain(["/colors.css"])
}

/// Returns the file at `path`, which must be one of [`paths`].
pub(super) fn file(path: &str) -> Response {
    match FILES.iter().find(|(known, ..)| *known == path) {
        Some((_, kind, content)) => ([(CONTENT_TYPE, *kind)], *content).into_response(),
        None => ([(CONTENT_TYPE, STYLE)], colors()).into_response(),
    }
}

/// Adds the headers that every response of this server has. `host` is the `Host` header of the request. The content security policy
/// names this host too, because some browsers do not permit a WebSocket if the policy has only `'self'`.
pub(super) fn guarded(mut response: Response, host: Option<&str>) -> Response {
    let policy = host.map_or(POLICY.to_owned(), |host| format!("{POLICY} ws://{host}"));
    let policy = HeaderValue::try_from(policy).unwrap_or(HeaderValue::from_static(POLICY));
    response.headers_mut().insert(CONTENT_SECURITY_POLICY, policy);
    response.headers_mut().extend(HEADERS.map(|(name, value)| (Some(name), value)));
    response
}

/// Returns the colors of the figures as a style sheet. In dark mode, colors that would be too dark are lighter.
fn colors() -> String {
    let sheet = |shown: fn(Color) -> Color| {
        let line = |(name, color)| {
            let [red, green, blue] = shown(color);
            format!("  --{name}: #{red:02x}{green:02x}{blue:02x};\n")
        };
        format!(":root {{\n{}}}\n", named_colors().map(line).collect::<String>())
    };
    format!("{}@media (prefers-color-scheme: dark) {{\n{}}}\n", sheet(|color| color), sheet(for_the_dark))
}

fn named_colors() -> impl Iterator<Item = (String, Color)> {
    let laws = Law::all().map(|law| (format!("law-{}", law.name()), law_color(law)));
    let axes = ["axis-x", "axis-y", "axis-z"].map(str::to_owned).into_iter().zip(AXES);
    let components = COMPONENTS.into_iter().enumerate().map(|(i, color)| (format!("component-{i}"), color));
    laws.chain(axes).chain(components)
}

/// The relative luminance (WCAG 2) that a color needs for a contrast of 4 : 1 on the dark page.
const VISIBLE: f64 = 0.18;

/// Mixes the color with white until the color is visible on black.
fn for_the_dark(color: Color) -> Color {
    let with_white = |percent: u32| {
        let mixed = |part: u8| (u32::from(part) + (255 - u32::from(part)) * percent / 100) as u8;
        color.map(mixed)
    };
    (0..=100).step_by(5).map(with_white).find(|mixed| luminance(*mixed) >= VISIBLE).unwrap_or(color)
}

/// Returns the relative luminance, 0 to 1 (WCAG 2).
fn luminance([red, green, blue]: Color) -> f64 {
    let linear = |part: u8| {
        let part = f64::from(part) / 255.0;
        if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_kinematics::control::Aim;

    #[test]
    fn the_page_is_small_and_loads_nothing_from_other_hosts() {
        let bytes: usize = FILES.iter().map(|(.., content)| content.len()).sum();
        assert!(bytes + colors().len() < 2_000_000, "{bytes}");
        for (path, _, content) in FILES {
            for elsewhere in ["http://", "https://", "//cdn", "@import", "eval("] {
                // Names of XML namespaces are not addresses.
                let content = content.replace("http://www.w3.org/2000/svg", "");
                assert!(!content.contains(elsewhere), "{path}: {elsewhere}");
            }
        }
    }

    #[test]
    fn every_law_and_every_task_has_a_line() {
        let texts = include_str!("page/texts.js");
        let tasks = Aim::NAMES.iter().chain(Aim::RELATIVE_NAMES).copied();
        for name in Law::ALL.iter().map(|law| law.name()).chain(tasks) {
            assert!(texts.contains(&format!("\n  {name}: \"")), "{name}");
        }
    }

    #[test]
    fn the_page_has_the_figures_colors() {
        let colors = colors();
        assert!(
            colors.contains("--law-diffc: #0072b2;") && colors.contains("--law-logc: #d55e00;"),
            "{colors}"
        );
        assert_eq!(colors.matches("--law-").count(), 2 * Law::ALL.len());
        for (name, color) in named_colors() {
            assert!(luminance(for_the_dark(color)) >= VISIBLE, "{name}");
        }
        assert!((luminance([255, 255, 255]) - 1.0).abs() < 1e-12);
    }
}

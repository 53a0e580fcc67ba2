//! Tests the drawn figures.

use crate::reproduction;
use dq_figures::{Width, frameplotter, png};

#[test]
fn frameplotter_draws_the_frame_of_the_paper_s_logarithm() {
    let half_log = nalgebra::Vector6::new(0.3, -0.2, 0.5, 0.1, 0.2, 0.3);
    let frame = frameplotter(&half_log);
    assert!((frame.translation.vector - nalgebra::Vector3::new(0.2, 0.4, 0.6)).norm() < 1e-15);
    let expected = nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(0.6, -0.4, 1.0));
    assert!(frame.rotation.angle_to(&expected) < 1e-12);
}

/// Returns the coordinates of every polyline, in the figure's pixels.
fn polylines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let points = |text: &str| {
        let pair = |pair: &str| {
            let (x, y) = pair.split_once(',').unwrap();
            (x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap())
        };
        text.split_whitespace().map(pair).collect()
    };
    svg.split("<polyline")
        .skip(1)
        .map(|tag| points(tag.split("points=\"").nth(1).unwrap().split('"').next().unwrap()))
        .collect()
}

#[test]
fn every_figure_has_its_curves_on_the_sheet_and_its_law_s_colour() {
    let names: Vec<_> = reproduction().figures.iter().map(|figure| figure.name.as_str()).collect();
    let expected = ["fig1", "fig2", "fig3", "fig3_angles", "fig4", "fig5", "fig6", "fig7", "fig8", "fig9"];
    assert_eq!(names[..10], expected);
    for figure in &reproduction().figures {
        let svg = figure.svg(Width::Screen);
        let attribute = |name: &str| {
            let text = svg.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap();
            text.parse::<f64>().unwrap()
        };
        let (width, height) = (attribute("width"), attribute("height"));
        let lines = polylines(&svg);
        assert!(lines.iter().map(Vec::len).sum::<usize>() > 200, "{}", figure.name);
        for (x, y) in lines.into_iter().flatten() {
            assert!((0.0..=width).contains(&x) && (0.0..=height).contains(&y), "{} at {x} {y}", figure.name);
        }
        let (diffc, logc) = (svg.contains("#0072B2"), svg.contains("#D55E00"));
        let expected = match figure.name.as_str() {
            "fig1" | "fig2" | "fig3" | "fig3_angles" | "fig4" => (false, false),
            "fig6" | "fig7" | "fig8" | "wrong_sign" => (true, false),
            "fig9" => (false, true),
            _ => (true, true),
        };
        assert_eq!((diffc, logc), expected, "{}", figure.name);
    }
}

#[test]
fn pictures_show_their_text_without_fonts_of_the_system() {
    let svg = reproduction().figures[0].svg(Width::Screen);
    let dark = |svg: &str| {
        let pixels = resvg::tiny_skia::Pixmap::decode_png(&png(svg, Width::Screen).unwrap()).unwrap();
        pixels
            .pixels()
            .iter()
            .filter(|pixel| pixel.red() < 100 && pixel.green() < 100 && pixel.blue() < 100)
            .count()
    };
    let without_text = svg.replace("<text", "<desc").replace("</text", "</desc");
    assert!(dark(&svg) > dark(&without_text) + 1000);
}

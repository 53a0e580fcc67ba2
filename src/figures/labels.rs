//! Places names next to points, so that the names cover as little of the drawing as possible.

use super::canvas::{Anchor, Canvas, Point, Rectangle};
use super::line::Line;
use super::style::{INK, LABEL, text_width};

/// The rectangle in which names may be placed, and the parts of the drawing that names should not cover.
pub(super) struct Labels {
    within: Rectangle,
    obstacles: Vec<Point>,
    taken: Vec<Rectangle>,
}

/// The distances between a name and its point that are tried \[px\]. A distant name gets a line to its point.
const RADII: [f64; 4] = [9.0, 26.0, 46.0, 70.0];

/// Number of directions that are tried at each distance.
const DIRECTIONS: u32 = 12;

impl Labels {
    /// Creates a `Labels` that places names within the rectangle `within`. `obstacles` are points of the drawing, and `taken` are
    /// occupied areas.
    pub fn new(within: Rectangle, obstacles: Vec<Point>, taken: Vec<Rectangle>) -> Self {
        Self { within, obstacles, taken }
    }

    /// Writes a name beside its point.
    pub fn draw(&mut self, canvas: &mut Canvas, name: &str, point: Point) {
        let (radius, place) = self.place(name, point);
        let middle = (place.left + 0.5 * place.width, place.top + 0.5 * place.height);
        if radius > RADII[0] {
            let end = (point.0.clamp(place.left, place.right()), point.1.clamp(place.top, place.bottom()));
            canvas.line(&[point, end], INK, 0.7, Line::Solid);
        }
        self.taken.push(place);
        canvas.text(name, middle, LABEL, Anchor::Center);
    }

    /// Finds the position for a name near its point that has the least [`cost`](Self::cost). Returns the distance of the name from
    /// the point \[px\], and the name's rectangle.
    fn place(&self, name: &str, point: Point) -> (f64, Rectangle) {
        let (width, height) = (text_width(name, LABEL), LABEL + 2.0);
        let around = |radius: f64| {
            (0..DIRECTIONS).map(move |k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS) - 0.5;
                let x = point.0 + (radius + 0.5 * width) * angle.cos();
                let y = point.1 + (radius + 0.5 * height) * angle.sin();
                (radius, Rectangle::around((x, y), width, height))
            })
        };
        let places = RADII.into_iter().flat_map(around);
        let best = places.map(|(radius, place)| (self.cost(radius, &place), radius, place));
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or((0.0, Rectangle { left: point.0, top: point.1, width, height }), |best| (best.1, best.2))
    }

    /// Returns the cost of writing a name into the rectangle `place`, `radius` away from its point. A name outside of the drawing
    /// costs the most. Each overlap with an occupied area costs less, each covered point of the drawing even less, and the distance
    /// the least.
    fn cost(&self, radius: f64, place: &Rectangle) -> f64 {
        let covered = self.obstacles.iter().filter(|point| place.contains(**point)).count();
        let overlaps = self.taken.iter().filter(|taken| taken.overlaps(place)).count();
        let outside = if self.within.encloses(place) { 0.0 } else { 1e6 };
        outside + 1e4 * overlaps as f64 + covered as f64 + 0.05 * radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEET: Rectangle = Rectangle { left: 0.0, top: 0.0, width: 300.0, height: 200.0 };

    #[test]
    fn a_name_stands_beside_its_point_and_not_on_what_is_drawn() {
        let free = Labels::new(SHEET, Vec::new(), Vec::new()).place("goal", (150.0, 100.0));
        assert_eq!(free.0, RADII[0]);
        // All places near the point are occupied, and places farther away are free.
        let crowd: Vec<_> =
            (0..4000).map(|k| (130.0 + f64::from(k % 60), 80.0 + 0.6 * f64::from(k / 60))).collect();
        let (radius, place) = Labels::new(SHEET, crowd.clone(), Vec::new()).place("goal", (160.0, 100.0));
        assert!(radius > RADII[0]);
        assert!(!crowd.iter().any(|point| place.contains(*point)));
        assert!(SHEET.encloses(&place));
    }

    #[test]
    fn two_names_of_one_point_do_not_overlap() {
        let mut labels = Labels::new(SHEET, Vec::new(), Vec::new());
        let first = labels.place("start", (5.0, 5.0)).1;
        labels.taken.push(first);
        let second = labels.place("end", (5.0, 5.0)).1;
        assert!(!first.overlaps(&second) && SHEET.encloses(&first) && SHEET.encloses(&second));
    }
}

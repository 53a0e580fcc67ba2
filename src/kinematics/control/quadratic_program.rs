//! Small quadratic programs: the joint velocities nearest to the desired ones under linear constraints.

/// The program `min (x − w)ᵀ H (x − w)` subject to `aₖ·x ≥ bₖ`, for joint velocities x, the desired joint velocities w and a weight
/// matrix H. It is solved by the dual active set method (Goldfarb & Idnani 1983), in the coordinates `Lᵀx` with `H = L Lᵀ`. In these
/// coordinates, the solution is the point nearest to w that satisfies the constraints.
///
/// The method begins at `w` and activates one violated constraint after the other, the most violated one first. So it finds a
/// solution near `w` in a step or two. The program allocates only if it has more joints or constraints than every program before
/// it.
#[derive(Clone, Debug)]
pub struct QuadraticProgram {
    count: usize,
    /// The rows of L.
    factor: Vec<f64>,
    /// The rows aₖ of the constraints.
    rows: Vec<f64>,
    /// The bounds bₖ of the constraints.
    bounds: Vec<f64>,
    /// The indices of the active constraints.
    active: Vec<usize>,
    /// The multipliers of the active constraints.
    multipliers: Vec<f64>,
    /// The normals `L⁻¹ aₖ` of the active constraints.
    normals: Vec<f64>,
    /// The orthogonalized normals Q in `normals = Q R`.
    square: Vec<f64>,
    /// The columns of R in `normals = Q R`.
    upper: Vec<f64>,
    /// The normal of the constraint to activate.
    normal: Vec<f64>,
    /// The component of `normal` orthogonal to the active normals.
    step: Vec<f64>,
    /// The components of `normal` along the columns of Q.
    parts: Vec<f64>,
    /// The coefficients of the active normals in their linear combination that is nearest to `normal`.
    relief: Vec<f64>,
    spare: Vec<f64>,
    wanted: Vec<f64>,
}

/// The error for constraints that no point satisfies, or for which rounding prevents a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Infeasible;

/// A constraint counts as violated if its slack is less than `-BROKEN` times the sum of the absolute values of the slack's terms.
const BROKEN: f64 = 1e-10;

/// A constraint counts as dependent on the active constraints if the part of its normal that is orthogonal to the active normals is
/// at most this fraction of the normal.
const WITHIN: f64 = 1e-9;

/// A solution may take at most this many steps for each joint and each constraint.
const MOST_STEPS: usize = 3;

impl QuadraticProgram {
    /// Allocates the buffers for this many joints and constraints.
    pub fn with_room(joints: usize, constraints: usize) -> Self {
        let (of_each, square) = (|| Vec::with_capacity(joints), || Vec::with_capacity(joints * joints));
        Self {
            count: joints,
            factor: square(),
            rows: Vec::with_capacity(constraints * joints),
            bounds: Vec::with_capacity(constraints),
            active: Vec::with_capacity(joints + 1),
            multipliers: Vec::with_capacity(joints + 1),
            normals: Vec::with_capacity((joints + 1) * joints),
            square: Vec::with_capacity((joints + 1) * joints),
            upper: Vec::with_capacity((joints + 1) * joints),
            normal: of_each(),
            step: of_each(),
            parts: of_each(),
            relief: of_each(),
            spare: of_each(),
            wanted: of_each(),
        }
    }

    /// Starts a new program for `count` joints with the symmetric weight matrix `h`, row after row. Returns false if `h` is not
    /// positive definite.
    pub fn begin(&mut self, count: usize, h: &[f64]) -> bool {
        self.count = count;
        self.rows.clear();
        self.bounds.clear();
        self.factor.clear();
        self.factor.resize(count * count, 0.0);
        for i in 0..count {
            for j in 0..=i {
                let product: f64 =
                    (0..j).map(|k| self.factor[i * count + k] * self.factor[j * count + k]).sum();
                let rest = h[i * count + j] - product;
                self.factor[i * count + j] = match i == j {
                    true if rest > 0.0 => rest.sqrt(),
                    true => return false,
                    false => rest / self.factor[j * count + j],
                };
            }
        }
        true
    }

    /// Adds the constraint `row · x ≥ bound`.
    pub fn add(&mut self, row: &[f64], bound: f64) {
        self.rows.extend_from_slice(row);
        self.bounds.push(bound);
    }

    /// Adds the constraint `sign · x[place] ≥ bound` on one element of x.
    pub fn add_one(&mut self, place: usize, sign: f64, bound: f64) {
        let end = self.rows.len();
        self.rows.resize(end + self.count, 0.0);
        self.rows[end + place] = sign;
        self.bounds.push(bound);
    }

    /// Relaxes each constraint that `x = 0` violates: sets its bound to 0.
    pub fn relax(&mut self) {
        self.bounds.iter_mut().for_each(|bound| *bound = bound.min(0.0));
    }

    /// Moves `x` from the desired point to the nearest point that satisfies the constraints.
    ///
    /// # Errors
    /// [`Infeasible`]; `x` is undefined then.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), Infeasible> {
        let count = self.count;
        for list in [&mut self.multipliers, &mut self.normals, &mut self.square, &mut self.upper] {
            list.clear();
        }
        self.active.clear();
        self.wanted.clear();
        self.wanted.extend_from_slice(x);
        for _ in 0..MOST_STEPS * (count + self.bounds.len()) + 1 {
            let Some(broken) = self.most_broken(x) else { return Ok(()) };
            self.take_in(broken, x)?;
        }
        Err(Infeasible)
    }

    /// Returns the multiplier of the constraint with this index at the latest solution; 0 if the constraint is inactive.
    pub fn multiplier(&self, constraint: usize) -> f64 {
        let place = self.active.iter().position(|number| *number == constraint);
        place.map_or(0.0, |place| self.multipliers[place])
    }

    fn row(&self, constraint: usize) -> &[f64] {
        &self.rows[constraint * self.count..][..self.count]
    }

    /// Returns the slack `aₖ·x − bₖ` of a constraint at `x`, and the sum of the absolute values of its terms. The rounding error of
    /// the slack is proportional to that sum.
    fn slack(&self, constraint: usize, x: &[f64]) -> (f64, f64) {
        let (mut slack, mut size) = (-self.bounds[constraint], self.bounds[constraint].abs());
        for (row, x) in self.row(constraint).iter().zip(x) {
            slack += row * x;
            size += (row * x).abs();
        }
        (slack, size)
    }

    fn most_broken(&self, x: &[f64]) -> Option<usize> {
        let mut most = (None, 0.0);
        for constraint in 0..self.bounds.len() {
            let (slack, size) = self.slack(constraint, x);
            if slack < most.1 && slack < -BROKEN * size && !self.active.contains(&constraint) {
                most = (Some(constraint), slack);
            }
        }
        most.0
    }

    /// Moves `x` until the constraint is satisfied. On the way, deactivates each constraint whose multiplier would become negative.
    fn take_in(&mut self, constraint: usize, x: &mut [f64]) -> Result<(), Infeasible> {
        self.normal.clear();
        self.normal.extend_from_slice(&self.rows[constraint * self.count..][..self.count]);
        solve_lower(&self.factor, self.count, &mut self.normal);
        let size: f64 = self.normal.iter().map(|part| part * part).sum();
        let mut multiplier = 0.0;
        // Each iteration except the last one deactivates one constraint.
        for _ in 0..=self.count {
            self.split(self.active.len());
            let free: f64 = self.step.iter().map(|part| part * part).sum();
            let (slack, _) = self.slack(constraint, x);
            let whole = if free > WITHIN * size { -slack / free } else { f64::INFINITY };
            let (first, longest) = self.first_to_go();
            let length = whole.min(longest);
            if !length.is_finite() {
                return Err(Infeasible);
            }
            multiplier += length;
            self.multipliers.iter_mut().zip(&self.relief).for_each(|(of, relief)| *of -= length * relief);
            if whole.is_finite() {
                solve_upper(&self.factor, self.count, &mut self.step);
                x.iter_mut().zip(&self.step).for_each(|(x, step)| *x += length * step);
            }
            if whole <= longest {
                self.active.push(constraint);
                self.multipliers.push(multiplier);
                self.normals.extend_from_slice(&self.normal);
                self.append(self.active.len() - 1);
                self.place(x);
                return Ok(());
            }
            self.let_go(first);
        }
        Err(Infeasible)
    }

    /// Computes x and the multipliers again from the active constraints. This restores the digits that steps along nearly dependent
    /// normals have lost.
    fn place(&mut self, x: &mut [f64]) {
        let count = self.count;
        self.relief.clear();
        for (k, constraint) in self.active.iter().enumerate() {
            let (slack, _) = self.slack(*constraint, &self.wanted);
            let column = &self.upper[k * count..][..k];
            let rest: f64 = column.iter().zip(&self.relief).map(|(upper, of)| upper * of).sum();
            self.relief.push((-slack - rest) / self.upper[k * count + k]);
        }
        self.step.clear();
        self.step.resize(count, 0.0);
        for (of, square) in self.relief.iter().zip(self.square.chunks_exact(count)) {
            self.step.iter_mut().zip(square).for_each(|(step, square)| *step += of * square);
        }
        solve_upper(&self.factor, count, &mut self.step);
        x.iter_mut()
            .zip(self.wanted.iter().zip(&self.step))
            .for_each(|(x, (wanted, step))| *x = wanted + step);
        for i in (0..self.active.len()).rev() {
            let after = i + 1..self.active.len();
            let rest: f64 = after.map(|k| self.upper[k * count + i] * self.multipliers[k]).sum();
            // A multiplier that rounding makes negative counts as 0.
            self.multipliers[i] = ((self.relief[i] - rest) / self.upper[i * count + i]).max(0.0);
        }
    }

    /// Splits `normal` into a linear combination of the first `active` columns of Q and a rest that is orthogonal to these columns.
    /// Sets `parts` to the coefficients of the columns, `step` to the rest, and `relief` to the coefficients of the same linear
    /// combination in terms of the active normals.
    fn split(&mut self, active: usize) {
        let count = self.count;
        self.step.clear();
        self.step.extend_from_slice(&self.normal);
        self.parts.clear();
        self.parts.resize(active, 0.0);
        // The second pass removes the rounding error of the first one.
        for _ in 0..2 {
            for k in 0..active {
                let of = &self.square[k * count..][..count];
                let part: f64 = of.iter().zip(&self.step).map(|(of, step)| of * step).sum();
                self.step.iter_mut().zip(of).for_each(|(step, of)| *step -= part * of);
                self.parts[k] += part;
            }
        }
        self.relief.clear();
        self.relief.extend_from_slice(&self.parts);
        for i in (0..active).rev() {
            let rest: f64 = (i + 1..active).map(|k| self.upper[k * count + i] * self.relief[k]).sum();
            self.relief[i] = (self.relief[i] - rest) / self.upper[i * count + i];
        }
    }

    /// Returns the index in `active` of the constraint whose multiplier becomes 0 first as the step gets longer. Also returns the
    /// length of the step at which that multiplier becomes 0.
    fn first_to_go(&self) -> (usize, f64) {
        let mut first = (0, f64::INFINITY);
        for (place, (multiplier, relief)) in self.multipliers.iter().zip(&self.relief).enumerate() {
            if *relief > WITHIN && multiplier / relief < first.1 {
                first = (place, multiplier / relief);
            }
        }
        first
    }

    fn let_go(&mut self, place: usize) {
        let count = self.count;
        self.active.remove(place);
        self.multipliers.remove(place);
        self.normals.drain(place * count..(place + 1) * count);
        self.square.truncate(place * count);
        self.upper.truncate(place * count);
        std::mem::swap(&mut self.normal, &mut self.spare);
        (place..self.active.len()).for_each(|k| self.append(k));
        std::mem::swap(&mut self.normal, &mut self.spare);
    }

    /// Orthogonalizes the active normal `number` against the normals before it, and appends the result to Q and R.
    fn append(&mut self, number: usize) {
        let count = self.count;
        self.normal.clear();
        self.normal.extend_from_slice(&self.normals[number * count..][..count]);
        self.split(number);
        let length = self.step.iter().map(|part| part * part).sum::<f64>().sqrt();
        self.square.extend(self.step.iter().map(|part| part / length));
        let end = self.upper.len();
        self.upper.resize(end + count, 0.0);
        self.upper[end..end + number].copy_from_slice(&self.parts);
        self.upper[end + number] = length;
    }
}

/// Sets `x` to `L⁻¹ x`; `factor` has the rows of L.
fn solve_lower(factor: &[f64], count: usize, x: &mut [f64]) {
    for i in 0..count {
        let rest: f64 = (0..i).map(|k| factor[i * count + k] * x[k]).sum();
        x[i] = (x[i] - rest) / factor[i * count + i];
    }
}

/// Sets `x` to `L⁻ᵀ x`; `factor` has the rows of L.
fn solve_upper(factor: &[f64], count: usize, x: &mut [f64]) {
    for i in (0..count).rev() {
        let rest: f64 = (i + 1..count).map(|k| factor[k * count + i] * x[k]).sum();
        x[i] = (x[i] - rest) / factor[i * count + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// Returns the weights and constraints of a random program. The point 0 satisfies the constraints.
    fn program(
        count: usize,
        seed: &[f64],
        rows: usize,
    ) -> (DMatrix<f64>, DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let mut numbers = seed.iter().cycle().enumerate().map(|(i, x)| (x * (1.0 + 0.37 * i as f64)).sin());
        let mut next = || numbers.next().unwrap();
        let root = DMatrix::from_fn(count, count, |_, _| next());
        let h = &root * root.transpose() + DMatrix::identity(count, count) * 1e-2;
        let a = DMatrix::from_fn(rows, count, |_, _| next());
        let b = DVector::from_fn(rows, |_, _| -0.3 * next().abs());
        let wanted = DVector::from_fn(count, |_, _| 2.0 * next());
        (h, a, b, wanted)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Checks the Karush–Kuhn–Tucker conditions, which only the solution satisfies.
        #[test]
        fn the_solution_is_the_nearest_one(count in 1..15usize, rows in 0..40usize, seed in prop::collection::vec(0.1..9.0f64, 7)) {
            let (h, a, b, wanted) = program(count, &seed, rows);
            let mut program = QuadraticProgram::with_room(2, 9);
            prop_assert!(program.begin(count, h.as_slice()));
            (0..rows).for_each(|row| program.add(a.row(row).transpose().as_slice(), b[row]));
            let mut x = wanted.clone();
            program.solve(x.as_mut_slice()).unwrap();
            let slack = &a * &x - &b;
            prop_assert!(slack.iter().all(|slack| *slack > -1e-8), "{slack}");
            let multipliers = DVector::from_fn(rows, |row, _| program.multiplier(row));
            prop_assert!(multipliers.iter().all(|of| *of >= 0.0), "{multipliers}");
            prop_assert!(multipliers.component_mul(&slack).norm() < 1e-7 * (1.0 + multipliers.norm()));
            let pull = &h * (&x - &wanted) - a.transpose() * &multipliers;
            prop_assert!(pull.norm() < 1e-7 * (1.0 + multipliers.norm()), "{pull}");
        }

        #[test]
        fn a_contradiction_is_found(count in 1..10usize, rows in 0..10usize, seed in prop::collection::vec(0.1..9.0f64, 7)) {
            let (h, a, b, wanted) = program(count, &seed, rows.max(1));
            let mut program = QuadraticProgram::with_room(2, 9);
            prop_assert!(program.begin(count, h.as_slice()));
            (0..a.nrows()).for_each(|row| program.add(a.row(row).transpose().as_slice(), b[row]));
            program.add((-a.row(0).transpose()).as_slice(), 0.1 - b[0]);
            prop_assert_eq!(program.solve(wanted.clone().as_mut_slice()), Err(Infeasible));
        }
    }

    #[test]
    fn bounds_of_single_numbers_are_independent() {
        let mut program = QuadraticProgram::with_room(2, 9);
        assert!(program.begin(2, &[1.0, 0.0, 0.0, 4.0]));
        program.add_one(0, 1.0, -0.5);
        program.add_one(1, -1.0, -0.25);
        let mut x = [-2.0, 1.0];
        program.solve(&mut x).unwrap();
        assert_eq!(x, [-0.5, 0.25]);
        assert!(!program.begin(2, &[1.0, 2.0, 2.0, 1.0]), "it bends both ways");
    }
}
